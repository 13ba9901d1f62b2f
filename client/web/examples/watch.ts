// Prints a world's frames: node dist/examples/watch.js [URL] WORLD [FRAMES]
import { Client, PneumaError } from "../src/index.js";

const [url, world, count] =
  process.argv[2]?.includes("://") === true
    ? process.argv.slice(2)
    : ["ws://127.0.0.1:7421/ws", ...process.argv.slice(2)];
if (url === undefined || world === undefined) {
  console.error("usage: watch [ws://HOST:PORT/ws] WORLD [FRAMES]");
  process.exit(2);
}

try {
  const client = await Client.connect(url);
  let left = Number(count ?? Infinity);
  await client.subscribe(
    world,
    { maxErrorM: 0.001 },
    {
      frame({ layout, tick, timeS, isKey, bytes, positions }) {
        const bodies = layout.softBodies.map(({ name }, body) => {
          const points = positions[body]!;
          const centre = [0, 0, 0];
          for (let i = 0; i < points.length; ++i) centre[i % 3]! += points[i]! / (points.length / 3);
          return `${name} (${centre.map((metres) => metres.toFixed(3)).join(", ")})`;
        });
        const kind = isKey ? "key" : "delta";
        console.log(`tick ${tick}  ${timeS.toFixed(3)} s  ${kind}  ${bytes} B  ${bodies.join("  ")}`);
        if (--left <= 0) client.close();
      },
      ended(error) {
        if (left > 0) console.error(error.message);
      },
    },
  );
} catch (error) {
  if (!(error instanceof PneumaError)) throw error;
  console.error(`watch: ${error.message}`);
  process.exit(1);
}
