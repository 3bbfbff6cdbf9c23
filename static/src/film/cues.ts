/** Captions: what is told at a stop, in pieces that two lines hold, each as long as it is read. */

/** Letters of a line, and of a caption of two. */
const LINE = 42;
const CUE = 2 * LINE;

export interface Cue {
  readonly from: number;
  readonly to: number;
  /** One or two lines. */
  readonly text: string;
}

/** The captions of a text that is told from one second to another. */
export function cuesOf(text: string, language: string, from: number, to: number): Cue[] {
  const pieces = piecesOf(text.trim(), language);
  const letters = pieces.reduce((sum, piece) => sum + piece.length, 0);
  let at = from;
  return pieces.map((piece) => {
    const start = at;
    at += ((to - from) * piece.length) / letters;
    return { from: start, to: at, text: twoLines(piece, language) };
  });
}

/** Sentences, joined where short and parted where long. */
function piecesOf(text: string, language: string): string[] {
  const pieces: string[] = [];
  for (const sentence of segmentsOf(text, language, "sentence")) {
    const last = pieces[pieces.length - 1];
    const trimmed = sentence.trim();
    if (trimmed === "") continue;
    if (last !== undefined && last.length + 1 + trimmed.length <= CUE) {
      pieces[pieces.length - 1] = `${last} ${trimmed}`;
    } else {
      pieces.push(...parted(trimmed, Math.ceil(trimmed.length / CUE), language));
    }
  }
  return pieces;
}

/** A text in about as long parts as can be. */
function parted(text: string, count: number, language: string): string[] {
  if (count < 2) return [text];
  const cut = breakNear(text, Math.ceil(text.length / count), language);
  if (cut === null) return [text];
  return [text.slice(0, cut).trim(), ...parted(text.slice(cut).trim(), count - 1, language)];
}

function twoLines(text: string, language: string): string {
  if (text.length <= LINE) return text;
  const cut = breakNear(text, Math.ceil(text.length / 2), language);
  return cut === null ? text : `${text.slice(0, cut).trim()}\n${text.slice(cut).trim()}`;
}

/** The place between two words that is nearest to a letter; null where there is none. */
function breakNear(text: string, letter: number, language: string): number | null {
  let best: number | null = null;
  let at = 0;
  let before = "";
  for (const word of segmentsOf(text, language, "word")) {
    // no break before a comma or a point
    const breaks = at > 0 && /[\p{L}\p{N}]/u.test(word) && (/\s$/.test(before) || isDense(word));
    if (breaks && (best === null || Math.abs(at - letter) < Math.abs(best - letter))) best = at;
    at += word.length;
    before = word;
  }
  return best;
}

/** Whether a word is of a script that writes without spaces. */
function isDense(word: string): boolean {
  return /[\p{Script=Han}\p{Script=Hiragana}\p{Script=Katakana}\p{Script=Thai}\p{Script=Khmer}\p{Script=Lao}]/u.test(word);
}

function segmentsOf(text: string, language: string, granularity: "sentence" | "word"): string[] {
  const segmenter = new Intl.Segmenter(language, { granularity });
  return [...segmenter.segment(text)].map(({ segment }) => segment);
}
