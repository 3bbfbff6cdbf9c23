/** What the kiosk's page says of itself, beside the tour. */

/** Opens the service corner: a PIN's digest. */
export interface Lock {
  /** Hexadecimal. */
  readonly salt: string;
  readonly rounds: number;
  readonly digest: string;
  /** How many digits the PIN has. */
  readonly length: number;
}

export interface KioskSettings {
  readonly idle_s: number;
  readonly warning_s: number;
  /** All controls stand in the lower half. */
  readonly low: boolean;
  /** Opening hours by day, "10:00-18:00"; null: always open. */
  readonly hours: Readonly<Record<string, string>> | null;
  readonly pin: Lock | null;
  /** Paths of QR codes, by the address that each leads to. */
  readonly codes: Readonly<Record<string, string>>;
}

/** Reads the page's attribute. */
export function kioskSettings(told: string): KioskSettings {
  return JSON.parse(told) as KioskSettings;
}
