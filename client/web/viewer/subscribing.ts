// Subscribes to a world as far as it can be had: a recording that is played holds no more than was recorded.
import type { Client, PneumaError, Stream, StreamListener, SubscribeOptions } from "../src/index.js";

/** By the field of the request that is refused, what to ask for instead. */
const lesser: Readonly<Record<string, SubscribeOptions>> = {
  "subscribe.max_error_m": { maxErrorM: 0 }, // the least there is
  "subscribe.velocities": { velocities: false },
  "subscribe.scalars": { scalars: false },
  "subscribe.contacts": { contacts: false },
};

export async function subscribeAsFarAsCanBe(
  client: Pick<Client, "subscribe">,
  world: string,
  options: SubscribeOptions,
  listener: StreamListener,
): Promise<Stream> {
  try {
    return await client.subscribe(world, options, listener);
  } catch (error) {
    const less = lesser[(error as PneumaError).where];
    const isAsked = less && (Object.keys(less) as (keyof SubscribeOptions)[]).some((field) => options[field]);
    if (!isAsked) throw error;
    return subscribeAsFarAsCanBe(client, world, { ...options, ...less }, listener);
  }
}
