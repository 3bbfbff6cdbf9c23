/** Opening hours. */

const DAYS = ["sun", "mon", "tue", "wed", "thu", "fri", "sat"];

/**
 * Whether the screen is awake.
 *
 * @param hours By day, "10:00-18:00"; past midnight where the end comes first, "20:00-02:00".
 */
export function isOpen(hours: Readonly<Record<string, string>>, now: Date): boolean {
  const minute = now.getHours() * 60 + now.getMinutes();
  const today = spanOf(hours[DAYS[now.getDay()] ?? ""]);
  const yesterday = spanOf(hours[DAYS[(now.getDay() + 6) % 7] ?? ""]);
  if (today) {
    const [from, to] = today;
    if (from < to ? minute >= from && minute < to : minute >= from) return true;
  }
  return yesterday !== null && yesterday[0] >= yesterday[1] && minute < yesterday[1];
}

/** Minutes from midnight. */
function spanOf(text: string | undefined): readonly [from: number, to: number] | null {
  const [from, to] = (text ?? "").split("-").map((time) => {
    const [hour, minute] = time.split(":").map(Number);
    return (hour ?? NaN) * 60 + (minute ?? NaN);
  });
  return from === undefined || to === undefined || Number.isNaN(from + to) ? null : [from, to];
}
