// Files that the page takes from whoever looks at it, and those that it hands out.
import { PneumaError } from "../src/index.js";

// As large as a mesh of the most faces may be written, in the longest of the formats.
const bytesMax = 64 * 1024 * 1024;

/** Throws PneumaError LIMIT_EXCEEDED for a file that is too large to be read. */
export function checkSize({ name, size }: File): void {
  if (size <= bytesMax) return;
  throw new PneumaError("LIMIT_EXCEEDED", `${Math.ceil(size / 2 ** 20)} MiB, and the page reads up to 64 MiB`, name);
}

/** Saves to where the browser puts downloads. */
export function save(name: string, parts: readonly BlobPart[], type: string): void {
  const url = URL.createObjectURL(new Blob([...parts], { type }));
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 60_000); // once the browser has taken it
}

/** Whether it could: a page of another host without TLS has no clipboard. */
export async function copy(text: string): Promise<boolean> {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    return false;
  }
}
