// Pointer to light and back, and the sizes of a drag's pictures: the arithmetic of clients/js/relit.js, without a page.
import assert from 'node:assert/strict'
import test from 'node:test'
import { handledIndex, handlePosition, lightAt, nextScale, spokenLight, sunAngles } from '../../clients/js/relit.js'

const size = [400, 300]
const point = { type: 'point', position: [0.1, 1, 0.6], color: '#ffffff', intensity: 1 }
const sun = { type: 'directional', azimuth: 315, elevation: 35, color: '#ffffff', intensity: 1 }
const sky = { type: 'environment', image: { image: 'x' }, rotation: [0, 0], intensity: 'auto' }

const near = (actual, wanted, tolerance = 0.05) =>
  actual.forEach((number, i) => assert.ok(Math.abs(number - wanted[i]) <= tolerance, `${actual} is not ${wanted}`))

// Integrated model, section 1: px = mx/cw, py = 1 - my/ch; pz is the distance control's.
test('a point light is under the pointer, and keeps its distance', () => {
  assert.deepEqual(lightAt(point, [100, 75], size).position, [0.25, 0.75, 0.6])
  assert.deepEqual(lightAt(point, [0, 300], size).position, [0, 0, 0.6])
  assert.deepEqual(lightAt(point, [-200, -30], size).position, [-0.5, 1.1, 0.6])
})

test('on the dome the centre is the viewer, the circle the horizon, and outside is behind', () => {
  assert.equal(lightAt(sun, [200, 150], size).elevation, 90)
  const at = (x, y) => sunAngles(lightAt(sun, [x, y], size))
  near(at(200, 0), [0, 0]) // the top of the picture
  near(at(350, 150), [90, 0]) // right
  near(at(200, 300), [180, 0])
  near(at(50, 150), [270, 0])
  near(at(200, 75), [0, 45])
  near(at(425, 150), [90, -45])
  near(at(9999, 150), [90, -90])
})

test('a sun given as a direction is where its angles are, and has angles once it is dragged', () => {
  const given = { type: 'directional', direction: [1, 1, Math.SQRT2], color: '#ffffff', intensity: 1 }
  near(sunAngles(given), [45, 45])
  near(handlePosition(given, size), handlePosition({ ...sun, azimuth: 45, elevation: 45 }, size))
  assert.ok(!('direction' in lightAt(given, [10, 10], size)))
})

test('the picture is 360 degrees of yaw wide and 180 of pitch high', () => {
  near(handlePosition(sky, size), [200, 150])
  assert.deepEqual(lightAt(sky, [300, 150], size).rotation, [90, 0])
  assert.deepEqual(lightAt(sky, [200, 225], size).rotation, [0, 45])
  assert.deepEqual(lightAt(sky, [-100, 999], size).rotation, [90, 90]) // yaw goes round, pitch ends
})

test('yaw and pitch of any number of turns have one place', () => {
  const at = (...rotation) => handlePosition({ ...sky, rotation }, size)
  for (const [given, wanted] of [[180, 180], [-180, 180], [181, -179], [720, 0], [-1000, 80]])
    near(at(given, 0), at(wanted, 0))
  near(at(0, 380), at(0, 20))
  near(at(0, 120), at(0, 90))
})

test('the handle of a light that was dragged is where it was dragged to', () => {
  for (const light of [point, sun, sky])
    for (const position of [[30, 40], [200.5, 149], [390, 10], [120, 290]])
      near(handlePosition(lightAt(light, position, size), size), position)
})

test('a light is not changed by being dragged', () => {
  for (const light of [point, sun, sky]) {
    const before = structuredClone(light)
    lightAt(light, [1, 2], size)
    assert.deepEqual(light, before)
  }
})

test('of a cropped picture, a point light is where the map has it; the dome is the picture\'s own', () => {
  const crop = [0.25, 0.5, 0.5, 0.25] // from the left, from the top, width, height: y from 0.25 to 0.5
  assert.deepEqual(lightAt(point, [0, 300], size, crop).position, [0.25, 0.25, 0.6])
  assert.deepEqual(lightAt(point, [400, 0], size, crop).position, [0.75, 0.5, 0.6])
  near(handlePosition({ ...point, position: [0.5, 0.375, 1] }, size, crop), [200, 150])
  near(handlePosition(sun, size, crop), handlePosition(sun, size))
})

test('fields that a light lacks have their defaults', () => {
  near(handlePosition({ type: 'point' }, size), handlePosition(point, size))
  near(handlePosition({ type: 'directional' }, size), handlePosition(sun, size))
  near(handlePosition({ type: 'environment', image: { image: 'x' } }, size), [200, 150])
})

test('the pictures of a drag shrink while they cost more than a frame, and grow back', () => {
  const timing = { network: 4, transfer: 1, render: 60, encode: 4 }
  const cost = (scale) => ({ ...timing, render: 60 * scale ** 2 })
  let scale = 1
  for (let frame = 0; frame < 40; ++frame) scale = nextScale(scale, cost(scale))
  const work = cost(scale).render + 5
  assert.ok(work > 9 && work < 13, `${work} ms of work at scale ${scale}`)
  for (let frame = 0; frame < 40; ++frame) scale = nextScale(scale, { ...timing, render: 1 })
  assert.equal(scale, 1)
  for (let frame = 0; frame < 100; ++frame) scale = nextScale(scale, { ...timing, render: 5000 })
  assert.equal(scale, 0.2)
})

test('where the way is long, pictures may take half as long', () => {
  const timing = { network: 200, transfer: 1, render: 80, encode: 4 }
  assert.equal(nextScale(1, timing), 1)
  assert.ok(nextScale(1, { ...timing, transfer: 60 }) < 1) // a slow way, not a long one
})

test('the handle is the first point light\'s, or else the first light\'s', () => {
  assert.equal(handledIndex([sun, point, point]), 1)
  assert.equal(handledIndex([sun, sky]), 0)
})

test('every light can be spoken', () => {
  assert.equal(spokenLight(point), '10 % from the left, 100 % up, 0.6 near')
  assert.equal(spokenLight({ ...point, position: [0.5, 0.5, -0.35] }), '50 % from the left, 50 % up, -0.35 near')
  assert.equal(spokenLight(sun), 'azimuth 315°, elevation 35°')
  assert.equal(spokenLight(sky), 'turned 0°, tilted 0°')
})
