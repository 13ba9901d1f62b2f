// The page and a recording in one HTML file, which opens from a disk without a server: the page's own files are written
// into it, and it finds the recording in itself.
import { PneumaError, type RecordingFile, readRecording } from "../src/index.js";

const place = "recording"; // the id of the element that holds it
const script = "viewer.js";
// As the bundler writes what a module is made of.
const imported = /(from|import)\s*"\.\/([\w-]+\.js)"/g;

async function textOf(name: string): Promise<string> {
  const reply = await fetch(name).catch((error: Error) => {
    throw new PneumaError("UNAVAILABLE", error.message, name);
  });
  if (!reply.ok) throw new PneumaError("UNAVAILABLE", `the server answers ${reply.status}`, name);
  return reply.text();
}

/** Throws PneumaError LIMIT_EXCEEDED for more than the browser puts into a text. */
async function base64(parts: readonly BlobPart[]): Promise<string> {
  const blob = new Blob([...parts]);
  const url = await new Promise<string>((resolve, reject) => {
    const reader = new FileReader();
    reader.onload = () => resolve((reader.result as string | null) ?? "");
    reader.onerror = () => reject(reader.error!);
    reader.readAsDataURL(blob);
  });
  const text = url.slice(url.indexOf(",") + 1);
  if (text.length < (4 * blob.size) / 3) {
    throw new PneumaError("LIMIT_EXCEEDED", `${Math.ceil(blob.size / 2 ** 20)} MiB are more than a page can hold`);
  }
  return text;
}

/** The page's modules by name, each with those that it is made of. What is loaded later is not among them. */
async function modules(): Promise<Map<string, string>> {
  const texts = new Map<string, string>();
  const names = [script];
  for (let name = names.pop(); name !== undefined; name = names.pop()) {
    if (texts.has(name)) continue;
    const text = await textOf(name);
    names.push(...[...text.matchAll(imported)].map(([, , part]) => part!));
    // In a file there is no place beside it: a map of names says where a part is.
    texts.set(name, text.replace(imported, '$1"$2"'));
  }
  return texts;
}

export async function oneFile(recording: readonly BlobPart[]): Promise<string> {
  const [page, style, texts] = await Promise.all([textOf("./"), textOf("style.css"), modules()]);
  const imports: Record<string, string> = {};
  for (const [name, text] of texts) imports[name] = `data:text/javascript;base64,${await base64([text])}`;
  const parts: readonly (readonly [RegExp, string])[] = [
    [/<link rel="icon"[^>]*>/, ""],
    [/<link rel="stylesheet"[^>]*>/, `<style>${style}</style>`],
    [/<script type="module"[^>]*><\/script>/, `<script type="importmap">${JSON.stringify({ imports })}</script>`],
    [
      /<\/body>/,
      `<script type="application/octet-stream" id="${place}">${await base64(recording)}</script>
<script type="module">import "${script}";</script></body>`,
    ],
  ];
  return parts.reduce((text, [from, to]) => text.replace(from, () => to), page);
}

/** What this page was saved with; undefined: it is of a server. */
export function ownRecording(): RecordingFile | undefined {
  const text = document.getElementById(place)?.textContent;
  if (!text) return undefined;
  return readRecording(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)));
}
