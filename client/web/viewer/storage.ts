// What the browser keeps for the page; where it may keep nothing, the page goes on without.
type Kept = "localStorage" | "sessionStorage"; // over visits; as long as the tab is open

export function recall(kept: Kept, key: string): string | null {
  try {
    return globalThis[kept].getItem(key);
  } catch {
    return null;
  }
}

export function remember(kept: Kept, key: string, value: string): void {
  try {
    globalThis[kept].setItem(key, value);
  } catch {
    // It is asked for again.
  }
}
