// The studio's plain parts (clients/studio), without a page: scenes, undo, what the server says of fields, zoom, words to paste.
import assert from 'node:assert/strict'
import test from 'node:test'
import { Relit } from '../../clients/js/relit.js'
import { allowed, readFields, readMediumFields, spokenRange } from '../../clients/studio/fields.js'
import { isPossible, lightingNames, underLighting } from '../../clients/studio/lightings.js'
import { spokenFailure } from '../../clients/studio/failures.js'
import { listedMedium, numbersOf, reachOf, spokenShare } from '../../clients/studio/media.js'
import { explainingScene, hasLayer, models, withHighlight, withLobe, withModel } from '../../clients/studio/models.js'
import { canRedo, canUndo, changed, redone, settled, startHistory, undone } from '../../clients/studio/history.js'
import {
  decodeScene,
  heldScene,
  hexColour,
  imagesOf,
  isBehind,
  member,
  newLight,
  overMap,
  shortened,
  shownScene,
  withMember,
} from '../../clients/studio/scene.js'
import { fileName, snippetsOf } from '../../clients/studio/snippets.js'
import { layoutOf, panned, pointOf, texelAt, wholeView, zoomed } from '../../clients/studio/view.js'

const encodeScene = (scene) => new Relit('').url(scene).match(/=([\w-]+)=*$/)[1] // as the studio's link has it

const near = (a, b, within = 1e-9) => assert.ok(Math.abs(a - b) <= within, `${a} is not ${b}`)

test('a scene goes into an address and comes back', () => {
  const scene = { height: { image: 'ü/+?'.repeat(20) }, lights: [{ color: [1, 0.5, 0.25] }], relief: 0.15 }
  const word = encodeScene(scene)
  assert.match(word, /^[\w-]+$/)
  assert.deepEqual(decodeScene(word), scene)
  assert.deepEqual(JSON.parse(Buffer.from(word, 'base64url').toString()), scene)
})

test('what is no scene in an address gives nothing', () => {
  for (const word of ['', 'x', '!!', 'bm90IGpzb24', encodeScene({ relief: 1 }), encodeScene(7)])
    assert.equal(decodeScene(word), null)
})

// IEC 61966-2-1: linear 0.2159 is 128 of 255 encoded.
test('linear colours are shown as sRGB', () => {
  assert.equal(hexColour('#AABBCC'), '#aabbcc')
  assert.equal(hexColour([0, 0.2159, 1]), '#0080ff')
  assert.equal(hexColour([2, 0, 0.4318]), '#ff0080')
})

test('a member is replaced in a copy, along objects and lists', () => {
  const scene = { lights: [{ position: [1, 2, 3] }, { position: [4, 5, 6] }], relief: 1 }
  const next = withMember(scene, 'lights.1.position.2', 9)
  assert.equal(member(next, 'lights.1.position.2'), 9)
  assert.equal(scene.lights[1].position[2], 6)
  assert.equal(next.lights[0], scene.lights[0])
  assert.equal(member(scene, 'material.specular.k'), undefined)
})

const defaults = {
  scene: { alpha: null, relief: 0.15, material: { depth: 0.008, specular: { k: 0, falloff: [0, 1] } } },
  point: { position: [0.1, 1, 0.6], intensity: 1 },
  directional: { azimuth: 315, elevation: 35 },
}
const whole = {
  height: { image: 'a' },
  alpha: null,
  relief: 0.15,
  material: { depth: 0.008, specular: { k: 0, falloff: [0, 1] } },
  lights: [{ type: 'point', position: [0.1, 1, 0.6], intensity: 1 }],
}

test('the shortest scene has what differs from the defaults, and its lights by their kind', () => {
  assert.deepEqual(shortened(whole, defaults), { height: { image: 'a' } })
  assert.deepEqual(shortened(withMember(whole, 'material.specular.falloff', [0.5, 1]), defaults), {
    height: { image: 'a' },
    material: { specular: { falloff: [0.5, 1] } },
  })
  const sun = { type: 'directional', azimuth: 315, elevation: 20 }
  assert.deepEqual(shortened({ ...whole, lights: [sun] }, defaults).light, { type: 'directional', elevation: 20 })
  assert.deepEqual(shortened({ ...whole, lights: [whole.lights[0], sun] }, defaults).lights, [
    { type: 'point' },
    { type: 'directional', elevation: 20 },
  ])
})

test('a soloed light shines alone, and another map takes the look but not what belonged to the old one', () => {
  const lights = [{ type: 'point' }, { type: 'environment', image: { image: 'e' } }]
  const scene = heldScene({
    ...whole,
    lights,
    alpha: { image: 'm' },
    output: { layer: 'normal', width: 300, region: [0, 0, 9, 9] },
  })
  assert.deepEqual(shownScene(scene, { solo: 1, region: null }).lights, [lights[1]])
  assert.equal(shownScene(scene, { solo: null, region: [1, 2, 3, 4] }).output.region[3], 4)
  assert.deepEqual(overMap(scene, 'b').output, { layer: 'normal', width: null, height: null, region: null })
  assert.equal(overMap(scene, 'b').alpha, null)
  assert.deepEqual(imagesOf({ ...scene, albedo: null }), ['a', 'm', 'e'])
  assert.deepEqual(heldScene({ light: lights[0] }).lights, [lights[0]])
  assert.equal(newLight('directional', null, { color: '#ff0000', intensity: 3 }).intensity, 3)
  assert.equal(newLight('environment', 'e', { color: '#ff0000', intensity: 3 }).intensity, 'auto')
})

test('counted samples take no lights at infinity', () => {
  const under = (illumination, name) => isPossible(underLighting({ base: 'none', material: { illumination } }, name, 'e'))
  assert.deepEqual(['Left', 'Raking', 'Sky'].map((name) => under('count', name)), [true, false, false])
  assert.deepEqual(['Left', 'Raking', 'Sky'].map((name) => under('length', name)), [true, true, true])
  assert.deepEqual(lightingNames(null).includes('Sky'), false)
})

test('a light from behind is told by its place or its direction', () => {
  const behind = [{ position: [0, 0, -0.1] }, { elevation: -1 }, { direction: [0, 1, -1] }]
  const before = [
    { position: [0, 0, 0.1] },
    { elevation: 0 },
    { direction: [0, 1, 1], elevation: -1 },
    { rotation: [180, 0] },
  ]
  assert.deepEqual([...behind, ...before].map(isBehind), [true, true, true, false, false, false, false])
})

test('a drag is one step of undo, and a change after undo forgets the future', () => {
  let history = startHistory(0)
  for (const state of [1, 2, 3]) history = changed(history, state, 'hand')
  history = changed(settled(history), 4, 'hand')
  history = changed(history, 5)
  assert.deepEqual(history.past, [0, 3, 4])
  history = undone(undone(history))
  assert.equal(history.present, 3)
  assert.equal(redone(history).present, 4)
  history = changed(history, 9, 'hand')
  assert.ok(!canRedo(history) && canUndo(history))
  assert.equal(undone(undone(undone(undone(history)))).present, 0)
})

test('a history does not grow for ever', () => {
  let history = startHistory(0)
  for (let i = 1; i <= 1000; ++i) history = changed(history, i)
  assert.ok(history.past.length <= 200)
})

test('fields are read with range, words, default and sentence', () => {
  const fields = readFields({
    components: {
      schemas: {
        Scene: {
          properties: {
            relief: { type: 'number', exclusiveMinimum: 0, maximum: 10, default: 0.15, description: 'Height.' },
            material: {
              type: 'object',
              properties: { steps: { type: 'integer', minimum: 1, maximum: 10000, default: 100 } },
            },
            base: {
              anyOf: [{ type: 'number', minimum: -10, maximum: 10 }, { const: 'none' }, { const: 'auto' }],
              default: 'none',
            },
          },
        },
        PointLight: {
          properties: { position: { type: 'array', items: { type: 'number', minimum: -1000, maximum: 1000 } } },
        },
        DirectionalLight: { properties: {} },
        EnvironmentLight: { properties: {} },
      },
    },
  })
  assert.equal(spokenRange(fields.get('relief')), 'above 0, at most 10; usually 0.15')
  assert.deepEqual(fields.get('base').choices, ['none', 'auto'])
  assert.equal(fields.get('point.position').high, 1000)
  assert.deepEqual(
    [0, 0.5, 99].map((n) => allowed(n, fields.get('relief'))),
    [null, 0.5, 10],
  )
  assert.equal(allowed(3.7, fields.get('material.steps')), 4)
  assert.equal(allowed(NaN, fields.get('relief')), null)
})

test('an object that may be null has fields of its own and something to begin with', () => {
  const numbers = { type: 'object', properties: { g: { type: 'array', items: { type: 'number', minimum: -0.99 } } } }
  const schemas = {
    Scene: {
      properties: {
        film: {
          anyOf: [{ type: 'object', properties: { thickness: { type: 'number', default: 0.01 } } }, { type: 'null' }],
          default: null,
        },
      },
    },
    PointLight: { properties: {} },
    DirectionalLight: { properties: {} },
    EnvironmentLight: { properties: {} },
    Medium: { oneOf: [{ type: 'string', enum: ['jam'] }, numbers] },
  }
  const fields = readFields({ components: { schemas } })
  assert.deepEqual(fields.get('film').start, { thickness: 0.01 })
  assert.equal(fields.get('film.thickness').default, 0.01)
  assert.equal(readMediumFields({ components: { schemas } }).get('g').low, -0.99)
})

const marble = { sigmaA: [0.0021, 0.0041, 0.0071], sigmaS: [2.19, 2.62, 3], g: [0, 0, 0], eta: 1.5 }
const media = [{ name: 'marble', title: 'Marble', medium: marble }]

// sigma_tr = sqrt(3 sigma_a (sigma_a + (1 - g) sigma_s)).
test('light reaches 1 / sigma_tr, and a medium is known by its name or its numbers', () => {
  near(reachOf(marble)[0], 1 / Math.sqrt(3 * 0.0021 * 2.1921))
  near(reachOf({ ...marble, g: [0.9, 0, 0] })[0], 1 / Math.sqrt(3 * 0.0021 * 0.2211))
  assert.ok(reachOf({ ...marble, sigmaA: [0, 0, 0] })[0] > 1000, 'nothing is absorbed')
  assert.equal(numbersOf('marble', media), marble)
  assert.equal(listedMedium(structuredClone(marble), media).name, 'marble')
  assert.equal(listedMedium({ ...marble, eta: 1.4 }, media), undefined)
  assert.deepEqual([0.0594, 0.00001, 1.7].map(spokenShare), ['5.9 %', '< 0.01 %', 'all'])
})

const integrated = {
  height: { image: 'a' },
  lights: [{ type: 'point' }],
  material: {
    model: 'integrated',
    illumination: 'count',
    specular: { k: 0 },
    highlight: { lobe: 'ward', k: 0, nt: 40, nb: 5 },
  },
  output: { layer: 'beauty' },
}
const onLayer = (scene, layer) => withMember(scene, 'output.layer', layer)

test('with another model goes what the server would refuse: counted samples, layers that are not there', () => {
  const below = withModel(integrated, 'dipole')
  assert.deepEqual([below.material.model, below.material.illumination], ['dipole', 'length'])
  assert.equal(withModel(onLayer(below, 'subsurface'), 'better-dipole').output.layer, 'subsurface')
  assert.equal(withModel(onLayer(below, 'subsurface'), 'integrated').output.layer, 'beauty')
  const layers = ['beauty', 'irradiance', 'subsurface', 'highlight', 'thickness', 'normal']
  const had = (scene) => layers.filter((layer) => hasLayer(scene, layer))
  assert.deepEqual(had(integrated), ['beauty', 'normal'])
  assert.deepEqual(had(below), layers)
  assert.deepEqual(had({ ...below, lights: [{ type: 'environment' }] }), layers.toSpliced(4, 1))
})

test("highlights are the model's own kind, as strong as they were; Lafortune's sharpness begins anew", () => {
  const strengths = ({ material }) => [material.specular.k, material.highlight.k]
  assert.deepEqual(strengths(withHighlight(integrated, true)), [0.2, 0])
  const below = withModel(integrated, 'dipole')
  assert.deepEqual(strengths(withHighlight(below, true)), [0, 0.2])
  assert.deepEqual(strengths(withHighlight(withMember(below, 'material.highlight.k', 0.7), true)), [0, 0.7])
  assert.deepEqual(strengths(withHighlight(withMember(below, 'material.specular.k', 0.7), false)), [0, 0])
  const { nt, nb, lobe } = withLobe(below, 'lafortune').material.highlight
  assert.deepEqual([lobe, nt, nb], ['lafortune', -1, -1])
  assert.equal(withLobe(withLobe(below, 'lafortune'), 'ashikhmin').material.highlight.nt, 10)
  assert.equal(withLobe(below, 'ashikhmin').material.highlight.nt, 40)
  const explained = explainingScene(below, models[3].name, 5, true)
  assert.deepEqual([explained.material.model, explained.lights[0].elevation], ['directional-dipole', 5])
})

test('zoomed at a point, the texel under it stays; the map never leaves the stage', () => {
  const [map, stage] = [
    [400, 200],
    [840, 640],
  ]
  assert.deepEqual(layoutOf(wholeView, map, stage, 20), { region: null, box: [20, 120, 800, 400], scale: 2 })
  const point = [300, 200]
  const texel = texelAt(wholeView, map, stage, 20, point)
  const view = zoomed(wholeView, map, stage, 20, point, 5)
  assert.deepEqual(texelAt(view, map, stage, 20, point), texel)
  const shown = layoutOf(view, map, stage, 20)
  assert.ok(shown.box[0] <= 0 && shown.box[0] + shown.box[2] >= stage[0], 'it covers the stage')
  assert.ok(shown.region[2] <= 86 && shown.region[3] <= 66, `${shown.region}`)
  const far = panned(view, map, stage, 20, [1e5, -1e5])
  assert.equal(layoutOf(far, map, stage, 20).region[0], 0)
  near(layoutOf(far, map, stage, 20).box[0], 0)
  assert.deepEqual(zoomed(view, map, stage, 20, point, 0.01), wholeView)
  assert.ok(zoomed(view, map, stage, 20, point, 1e9).zoom < 20)
  const [x, y] = pointOf(view, map, stage, 20, texel)
  assert.ok(Math.abs(x - point[0]) <= 5 && Math.abs(y - point[1]) <= 5)
})

test('words to paste are quoted for where they go', () => {
  assert.equal(fileName("Bust of Plato, a scan's", 'jpeg'), 'Bust-of-Plato-a-scan-s-relit.jpg')
  assert.equal(fileName('münze.TIF', 'png'), 'münze-relit.png')
  const picture = {
    server: 'http://h',
    name: 'a "b" & c',
    file: 'a "b" & c',
    format: 'png',
    samples: [],
    images: ['x'],
    url: 'http://h/?a&b',
    link: '',
    element: { height: { image: 'x' }, preset: "it's" },
    size: [3, 4],
  }
  const [, , curl, img, element, cli] = snippetsOf({ height: { image: 'x' }, preset: "it's" }, picture).map(
    ({ text }) => text,
  )
  assert.ok(curl.endsWith(`--json '{"height":{"image":"x"},"preset":"it'\\''s"}'`), curl)
  assert.equal(img, '<img src="http://h/?a&amp;b" width="3" height="4" alt="a &quot;b&quot; &amp; c">')
  assert.ok(element.includes(`scene='{"preset":"it&#39;s"}'`), element)
  assert.ok(cli.startsWith("relit render --scene - -o 'a-b-c-relit.png' --server 'http://h' <<'END'\n"), cli)
  assert.ok(!snippetsOf({ height: { image: 'x' } }, { ...picture, samples: ['x'] })[5].text.includes('--server'))
})

test('failures say what to do', () => {
  assert.equal(spokenFailure({ status: 0 }, 4000), 'The server does not answer. Is it running? Trying again in 4 s.')
  assert.match(
    spokenFailure({ code: 'not-found', status: 404, problem: { detail: 'Gone.' } }),
    /^Gone\. .* open the file again\.$/,
  )
  assert.equal(spokenFailure({ status: 422, message: 'No.' }), 'No. Undo brings back what worked.')
})
