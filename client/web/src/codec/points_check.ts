// A few bits by which a reader sees that it holds the server's points: proto/WIRE.md, "Check".

const digestFactor = 16_777_619;
const checkFactor = 2_654_435_761;
const checkBits = 14;
const near = 2 ** 31;
const highUnit = 2 ** -32;

/** Of a coordinate below 2^53 in size. */
function wordOf(coordinate: number): number {
  return (coordinate | 0) + Math.imul(3, Math.floor((coordinate + near) * highUnit) | 0);
}

/**
 * Of a body's points, x y z of each slot.
 * @param furthest the largest coordinate, in size
 */
export function pointsDigest(points: Float64Array, furthest: number): number {
  const isNear = furthest < near; // then a coordinate is its own word, which saves half the time
  let x = 0;
  let y = 0;
  let z = 0;
  for (let i = 0; isNear && i < points.length; i += 3) {
    x = (Math.imul(x, digestFactor) + (points[i]! | 0)) | 0;
    y = (Math.imul(y, digestFactor) + (points[i + 1]! | 0)) | 0;
    z = (Math.imul(z, digestFactor) + (points[i + 2]! | 0)) | 0;
  }
  for (let i = 0; !isNear && i < points.length; i += 3) {
    x = (Math.imul(x, digestFactor) + wordOf(points[i]!)) | 0;
    y = (Math.imul(y, digestFactor) + wordOf(points[i + 1]!)) | 0;
    z = (Math.imul(z, digestFactor) + wordOf(points[i + 2]!)) | 0;
  }
  return (Math.imul(Math.imul(x, digestFactor) + y, digestFactor) + z) | 0;
}

/** Of the digests of a payload's bodies, in order. */
export function pointsCheck(digests: readonly number[]): number {
  let sum = 0;
  for (const digest of digests) sum = (Math.imul(sum, digestFactor) + digest) | 0;
  return Math.imul(sum ^ (sum >>> 15), checkFactor) >>> (32 - checkBits);
}
