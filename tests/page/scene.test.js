// Scenes as the page holds them (clients/page/scene.js), without a page.
import assert from 'node:assert/strict'
import test from 'node:test'
import {
  decodeScene, encodeScene, heldScene, hexColour, member, previewOf, finalOf, withMember,
} from '../../clients/page/scene.js'

test('a scene goes into an address and comes back', () => {
  const scene = { height: { image: 'ü/+?'.repeat(20) }, lights: [{ color: [1, 0.5, 0.25] }], relief: 0.15 }
  const word = encodeScene(scene)
  assert.match(word, /^[\w-]+$/)
  assert.deepEqual(decodeScene(word), scene)
  assert.deepEqual(JSON.parse(Buffer.from(word, 'base64url').toString()), scene)
})

test('what is no scene in an address gives nothing', () => {
  for (const word of ['', 'x', '!!', 'bm90IGpzb24']) assert.equal(decodeScene(word), null)
})

test('a scene is held with lights, and of output only what its look takes', () => {
  const light = { type: 'point' }
  const output = { format: 'png', width: 12, exposure: 1, tone: 'filmic', transfer: 'none', background: null }
  assert.deepEqual(heldScene({ light, output, relief: 1 }),
    { lights: [light], relief: 1, output: { exposure: 1, tone: 'filmic', transfer: 'none' } })
  assert.deepEqual(heldScene({ lights: [light, light], output: {} }).lights, [light, light])
})

test('previews and final pictures keep the look', () => {
  const scene = heldScene({ light: {}, output: { exposure: 1, tone: 'clip', transfer: 'none' } })
  assert.equal(previewOf(scene, 300, '#000000').output.transfer, 'none')
  assert.equal(previewOf(scene, 300, '#000000').output.accuracy, 'preview')
  assert.deepEqual(finalOf(scene, 300).output,
    { exposure: 1, tone: 'clip', transfer: 'none', format: 'webp', quality: 92, width: 300 })
})

// IEC 61966-2-1: linear 0.2159 is 128 of 255 encoded.
test('linear colours are shown as sRGB', () => {
  assert.equal(hexColour('#AABBCC'), '#aabbcc')
  assert.equal(hexColour([0, 0.2159, 1]), '#0080ff')
  assert.equal(hexColour([2, 0, 0.4318]), '#ff0080')
  assert.equal(hexColour([0, 0, 0]), '#000000')
})

test('a member is replaced in a copy, along objects and lists', () => {
  const scene = { lights: [{ position: [1, 2, 3] }, { position: [4, 5, 6] }], relief: 1 }
  const changed = withMember(scene, 'lights.1.position.2', 9)
  assert.equal(member(changed, 'lights.1.position.2'), 9)
  assert.equal(scene.lights[1].position[2], 6)
  assert.equal(changed.lights[0], scene.lights[0])
  assert.equal(member(scene, 'material.specular.k'), undefined)
})
