// Which of the words that there are somebody may have meant.

/** How many letters have to be put in, left out or replaced to make the one of the other. */
function distance(a: string, b: string): number {
  let row = Array.from({ length: b.length + 1 }, (_, j) => j);
  for (let i = 1; i <= a.length; ++i) {
    const next = [i];
    for (let j = 1; j <= b.length; ++j) {
      next[j] = Math.min(row[j]! + 1, next[j - 1]! + 1, row[j - 1]! + Number(a[i - 1] !== b[j - 1]));
    }
    row = next;
  }
  return row[b.length]!;
}

/** The closest word; undefined where more than a third of the letters differ. */
export function nearest(word: string, words: readonly string[]): string | undefined {
  if (word.length > 100) return undefined; // no name, and slow
  const lettersMax = Math.max(1, Math.floor(word.length / 3));
  const ranked = words
    .map((each) => ({ each, letters: distance(word.toLowerCase(), each.toLowerCase()) }))
    .sort((a, b) => a.letters - b.letters);
  return ranked[0] && ranked[0].letters <= lettersMax ? ranked[0].each : undefined;
}
