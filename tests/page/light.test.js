// Pointer to light and back (clients/page/light.js), without a page.
import assert from 'node:assert/strict'
import test from 'node:test'
import {
  halfTurn, handledIndex, handlePosition, lightAt, spokenLight, sunAngles, withinReach,
} from '../../clients/page/light.js'

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

test('a point light far outside stays within what the interface takes', () => {
  assert.deepEqual(lightAt(point, [1e9, 1e9], size).position.slice(0, 2), [1000, -1000])
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

test('degrees are brought into a half turn', () => {
  for (const [given, wanted] of [[0, 0], [180, 180], [-180, 180], [181, -179], [720, 0], [-1000, 80]])
    assert.equal(halfTurn(given), wanted)
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

test('the handle stays within reach of the picture', () => {
  assert.deepEqual(withinReach([-500, 90], size, 18), [-18, 90])
  assert.deepEqual(withinReach([500, 301], size, 18), [418, 301])
})

test('the handle is the first point light\'s, or else the first light\'s', () => {
  assert.equal(handledIndex([sun, point, point]), 1)
  assert.equal(handledIndex([sun, sky]), 0)
})

test('every light can be spoken', () => {
  assert.equal(spokenLight(point), '10 % from the left, 100 % up, 0.60 in front')
  assert.equal(spokenLight({ ...point, position: [0.5, 0.5, -0.35] }), '50 % from the left, 50 % up, 0.35 behind')
  assert.equal(spokenLight(sun), 'azimuth 315°, elevation 35°')
  assert.equal(spokenLight(sky), 'turned 0°, tilted 0°')
})
