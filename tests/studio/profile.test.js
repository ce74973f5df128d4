// The light's path that the studio draws (clients/studio/profile.js): closed forms, as the model states them. That it is the
// server's own is tested in studio.test.js.
import assert from 'node:assert/strict'
import test from 'node:test'
import { deflateSync } from 'node:zlib'
import { decodePng } from '../../clients/studio/png.js'
import {
  borders,
  illuminationOf,
  insideLength,
  insideParts,
  normalAt,
  profileAlong,
  rayTo,
  startOf,
  surfaceAt,
  surfacePoint,
  visibilityOf,
} from '../../clients/studio/profile.js'

const near = (a, b, within) => assert.ok(Math.abs(a - b) <= within, `${a} is not ${b} within ${within}`)
const solidOf = (height, { width = 64, rows = 48, base = null, alpha = null, relief = 1 } = {}) => ({
  width,
  height: rows,
  relief,
  base,
  alpha,
  heights: Float32Array.from({ length: width * rows }, (_, k) =>
    height(((k % width) + 0.5) / width, (rows - 0.5 - Math.floor(k / width)) / width),
  ),
})
const lengthAt = (solid, texel, depth, light, offset = 'normal') => {
  const from = startOf(solid, texel, depth, offset)
  return insideLength(insideParts(solid, from, rayTo(solid, from, light)))
}

test('on a plane d is the cosine, for every tilt and depth', () => {
  const light = { type: 'directional', azimuth: 315, elevation: 35 }
  for (const tilt of [0, 0.2, 0.5])
    for (const depth of [0.01, 0.05]) {
      const plane = solidOf((x) => 0.3 + tilt * x)
      const { direction } = rayTo(plane, [0, 0, 0], light)
      const n = normalAt(plane, [32, 24])
      const cosine = n.reduce((sum, part, axis) => sum + part * direction[axis], 0)
      const r = lengthAt(plane, [32, 24], depth, light)
      near(illuminationOf(r, { illumination: 'length', depth }), cosine, 1e-4)
    }
})

test('what arrives at a surface is whole in the open, and less the longer its way through the relief', () => {
  const light = { type: 'directional', azimuth: 90, elevation: 20 }
  const walled = solidOf((x) => (x > 0.7 && x < 0.8 ? 0.9 : 0.1), { width: 320, rows: 240 })
  const at = (texel) => {
    const from = surfacePoint(walled, texel)
    return insideLength(insideParts(walled, from, rayTo(walled, from, light)))
  }
  const material = { depth: 0.01, attenuation: 5 }
  const seen = (texel, illumination) => visibilityOf(at(texel), { ...material, illumination })
  assert.deepEqual([seen([300, 120], 'length'), seen([300, 120], 'exponential')], [1, 1])
  near(seen([150, 120], 'length'), (0.01 / 0.1) * Math.cos(Math.PI / 9), 0.005)
  near(seen([150, 120], 'exponential'), Math.exp((-5 * 0.1) / Math.cos(Math.PI / 9)), 0.02)
})

test('a wall lengthens r by its thickness along the ray', () => {
  const wall = (z) => solidOf((x) => (x > 0.7 && x < 0.8 ? z : 0.1), { width: 320, rows: 240 })
  const light = { type: 'directional', azimuth: 90, elevation: 20 }
  const without = lengthAt(wall(0.1), [100, 120], 0.01, light)
  const through = lengthAt(wall(0.9), [100, 120], 0.01, light)
  near(through - without, 0.1 / Math.cos(Math.PI / 9), 0.01)
})

test('light from behind crosses the thickness of a panel, and never leaves endless ground', () => {
  const behind = { type: 'directional', azimuth: 0, elevation: -90 }
  near(
    lengthAt(
      solidOf(() => 0.2, { base: -0.05 }),
      [10, 10],
      0.01,
      behind,
    ),
    0.24,
    1e-5,
  )
  assert.equal(
    lengthAt(
      solidOf(() => 0.2),
      [10, 10],
      0.01,
      behind,
    ),
    Infinity,
  )
  assert.equal(illuminationOf(Infinity, { illumination: 'length', depth: 0.01 }), 0)
})

test('a ray that leaves the map low goes on in endless ground', () => {
  const ground = solidOf(() => 0)
  const r = lengthAt(ground, [60, 24], 0.02, { type: 'directional', azimuth: 90, elevation: 10 })
  near(r, 0.02 / Math.sin(Math.PI / 18), 1e-3)
})

test('a point light ends the ray', () => {
  const flat = solidOf(() => 0.1)
  const inside = { type: 'point', position: [0.5, 0.5, 0.05] }
  const from = startOf(flat, [10, 24], 0.08, 'normal')
  const ray = rayTo(flat, from, inside)
  near(insideLength(insideParts(flat, from, ray)), ray.distance, 1e-6)
  assert.equal(rayTo(flat, from, { type: 'environment' }), null)
})

test('masked texels are no material', () => {
  const masked = solidOf(() => 0.2, {
    base: 0,
    alpha: Float32Array.from({ length: 64 * 48 }, (_, k) => (k % 64 < 32 ? 1 : 0)),
  })
  assert.deepEqual(
    profileAlong(masked, [0.25, 0.3], [0.75, 0.3], 2).map((z) => z == null),
    [false, true, true],
  )
  near(lengthAt(masked, [16, 24], 0.01, { type: 'directional', azimuth: 90, elevation: 1 }), 0.2422, 0.002)
})

test('the surface is bilinear and the line through a point ends at the borders', () => {
  const ramp = solidOf((x, y) => x + y)
  near(surfaceAt(ramp, 0.4, 0.3), 0.7, 1e-6)
  assert.deepEqual(borders(ramp, [0.25, 0.5], [1, 0]), [-0.25, 0.75])
  const [back, ahead] = borders(ramp, [0.5, 0.375], [Math.SQRT1_2, Math.SQRT1_2])
  near(ahead, 0.375 * Math.SQRT2, 1e-9)
  near(back, -ahead, 1e-9)
})

// A PNG of 16-bit grey whose rows use all five filters.
function pngOf(width, rows) {
  const chunk = (type, data) => {
    const head = Buffer.alloc(8)
    head.writeUInt32BE(data.length)
    head.write(type, 4)
    return Buffer.concat([head, data, Buffer.alloc(4)]) // no reader of ours looks at the sums
  }
  const header = Buffer.alloc(13)
  header.writeUInt32BE(width)
  header.writeUInt32BE(rows.length, 4)
  header.set([16, 0, 0, 0, 0], 8)
  const raw = rows.map((row) => Buffer.from(row.flatMap((number) => [number >> 8, number & 255])))
  const paeth = (a, b, c) => [a, b, c].sort((p, q) => Math.abs(a + b - c - p) - Math.abs(a + b - c - q))[0]
  const packed = raw.map((row, k) =>
    Buffer.from([
      k % 5,
      ...row.map((byte, i) => {
        const [a, b, c] = [row[i - 2] ?? 0, raw[k - 1]?.[i] ?? 0, raw[k - 1]?.[i - 2] ?? 0]
        return byte - [0, a, b, (a + b) >> 1, paeth(a, b, c)][k % 5]
      }),
    ]),
  )
  const parts = [
    Buffer.from('89504e470d0a1a0a', 'hex'),
    chunk('IHDR', header),
    chunk('IDAT', deflateSync(Buffer.concat(packed))),
    chunk('IEND', Buffer.alloc(0)),
  ]
  const file = Buffer.concat(parts)
  return file.buffer.slice(file.byteOffset, file.byteOffset + file.length)
}

test('a PNG keeps all 16 bits, whatever filter its rows have', async () => {
  const rows = Array.from({ length: 11 }, (_, j) =>
    Array.from({ length: 9 }, (_, i) => (i * 7919 + j * 104729) % 65536),
  )
  const { width, height, channels, numbers } = await decodePng(pngOf(9, rows))
  assert.deepEqual([width, height, channels], [9, 11, 1])
  assert.deepEqual(
    Array.from(numbers, (number) => Math.round(number * 65535)),
    rows.flat(),
  )
})

test('what is no PNG, or half of one, is refused', async () => {
  await assert.rejects(decodePng(new ArrayBuffer(100)), /no PNG/)
  await assert.rejects(decodePng(pngOf(9, [Array(9).fill(1)]).slice(0, 50)))
})
