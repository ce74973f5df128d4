// The studio: a height map, and the light to move over it. This module puts the others together.
import { bindOpen } from './open.js'
import { spokenFailure } from './failures.js'
import { lightDefaults, readFields, readMediumFields } from './fields.js'
import { KeyedClient } from './keys.js'
import { bindPanel, environmentsOf } from './panel.js'
import { decodeScene, heldScene, overMap } from './scene.js'
import { bindSection } from './section.js'
import { bindShare } from './share.js'
import { bindModels } from './sheet.js'
import { bindShelf, sceneWith } from './shelf.js'
import { bindStage } from './stage.js'
import { createStore } from './store.js'
import { thumbnailQueue } from './thumbnails.js'
import { bindKeys, bindTabs, bindTheme, bindTips, showTimings } from './shell.js'

const $ = (id) => document.getElementById(id)
const client = new KeyedClient('')
const store = createStore()
const picture = $('picture')
const before = $('before')
picture.client = before.client = client

// ---- what is said; kinds: `frame`, until a picture comes; `wait`, until an answer comes; `choice`, for a while

let fading = null
function say(sentence, kind = 'choice', isError = false) {
  clearTimeout(fading)
  const notice = $('notice')
  notice.dataset.kind = kind
  notice.classList.toggle('error', isError)
  $('message').textContent = sentence
  notice.hidden = !sentence
  if (kind === 'choice' && sentence) fading = setTimeout(() => say('', ''), isError ? 12000 : 5000)
}
const unsay = (...kinds) => kinds.includes($('notice').dataset.kind) && say('', '')
const fail = (error) => say(spokenFailure(error), 'choice', true)
$('dismiss').addEventListener('click', () => say('', ''))

/** Tries again for as long as that may help. */
async function patiently(work) {
  for (let failures = 0; ; ++failures)
    try {
      const result = await work()
      unsay('wait')
      return result
    } catch (error) {
      if (!error.temporary) throw error
      const wait = Math.max(500 * 2 ** Math.min(failures, 4), (error.retryAfter ?? 0) * 1000)
      say(spokenFailure(error, wait), 'wait', true)
      await new Promise((done) => setTimeout(done, wait))
    }
}

picture.addEventListener('relit-error', (event) => {
  event.preventDefault()
  say(spokenFailure(event.detail.error, event.detail.again), 'frame', true)
})
picture.addEventListener('relit-recovery', () => unsay('frame', 'wait'))
before.addEventListener('relit-error', (event) => event.preventDefault())

// ---- choices: the newest one counts

let choices = 0
const chosen =
  (work) =>
  async (...given) => {
    const mine = ++choices
    const isNewest = () => mine === choices
    try {
      await work(isNewest, ...given)
    } catch (error) {
      if (isNewest()) fail(error)
    }
  }

/** What a preset leaves alone: how the file is to be. */
const fileOf = ({ format, bitDepth, quality, effort, width, height, region }) => ({
  format,
  bitDepth,
  quality,
  effort,
  width,
  height,
  region,
})

const openRelief = chosen(async (isNewest, relief) => {
  store.know(relief)
  if (!relief.scene) return store.change(overMap(store.scene, relief.id)) // one's own: under the look that is on
  const { scene } = await patiently(() => client.scene({ ...relief.scene, height: { image: relief.id } }))
  if (isNewest()) store.open(heldScene(scene))
})

const choosePreset = chosen(async (isNewest, name) => {
  const { height, alpha, albedo, bump, output } = store.scene
  const images = { height, ...(alpha && { alpha }), ...(albedo && { albedo }), ...(bump && { bump }) }
  const whole = heldScene((await patiently(() => client.scene({ preset: name, ...images }))).scene)
  if (!isNewest()) return
  const scene = { ...whole, output: { ...whole.output, ...fileOf(output) } }
  store.look = { name, scene }
  store.open(scene)
})

const openLink = chosen(async (isNewest, linked) => {
  const { scene } = await patiently(() => client.scene(linked))
  if (!store.knows(scene.height.image)) {
    const info = await patiently(() => client.get(`/v1/images/${scene.height.image}`))
    store.know({ ...info, title: 'Relief of the link' })
    catalogue.reliefs.push(store.mapOf(scene.height.image))
  }
  if (isNewest()) store.open(heldScene(scene))
})

// ---- from the beginning

const catalogue = { presets: [], reliefs: [], environments: [], samples: [], defaults: null }
const linked = () => {
  const word = location.hash.match(/^#scene=([\w-]+)$/)?.[1]
  return word === undefined ? undefined : decodeScene(word)
}

async function start() {
  const [presets, samples, { media }, api] = await patiently(() =>
    Promise.all(['/v1/presets', '/v1/samples', '/v1/media', '/openapi.json'].map((path) => client.get(path))),
  )
  const fields = readFields(api)
  catalogue.presets = presets.presets
  catalogue.samples = samples.samples.map(({ id }) => id)
  catalogue.reliefs = samples.samples.filter(({ kind }) => kind === 'relief')
  catalogue.environments = store.environments = samples.samples.filter(({ kind }) => kind === 'environment')
  catalogue.reliefs.forEach(store.know)
  const { scene } = await patiently(() => client.scene({ height: { image: catalogue.reliefs[0].id } }))
  catalogue.defaults = { scene: (({ light, ...rest }) => rest)(scene), ...lightDefaults(fields) }

  const stage = bindStage(store, $('stage'), picture, before)
  const isIdle = () => picture.ariaBusy !== 'true'
  const askShelf = thumbnailQueue(client, () => isIdle() && !$('models').open)
  const showShelf = bindShelf(store, client, catalogue, askShelf, {
    openRelief,
    choosePreset,
    environments: () => environmentsOf(store),
    chooseEnvironment: (id) => store.change(sceneWith(store.scene, 'environment', id, store.ui.active)),
  })
  const showPanel = bindPanel(store, fields, { list: media, fields: readMediumFields(api) })
  bindModels(store, client, catalogue, thumbnailQueue(client, isIdle), media)
  const section = bindSection(store, client, stage, fail)
  const share = bindShare(store, client, catalogue, stage, say, fail)
  const opener = bindOpen(store, client, catalogue, say, fail)
  bindKeys(store, stage)
  showTimings(picture)
  store.listen((by) => {
    if (by === 'rest' || !store.scene) return
    if (by !== 'ui') unsay('choice')
    stage.show(by)
    showPanel()
    section.show()
    share.show()
    if (by !== 'hand') {
      showShelf()
      opener.show()
      showBar()
    }
    if (by !== 'ui') share.address()
  })
  addEventListener('hashchange', () => linked() && openLink(linked()))
  await begin()
}

/** The link's scene, or the first sample with a word on why not. */
async function begin() {
  const scene = linked()
  if (scene) await openLink(scene)
  if (store.scene) return
  const sentence = scene === null ? 'The link holds no scene. Here is a sample instead.' : $('message').textContent
  await openRelief(catalogue.reliefs[0])
  if (sentence) say(sentence, 'choice', true)
}

function showBar() {
  $('title').textContent = store.map.title
  document.title = `${store.map.title} - Relit`
  $('texels').textContent = `${store.map.width} × ${store.map.height}`
  $('undo').disabled = !store.canUndo
  $('redo').disabled = !store.canRedo
  $('credit').textContent = store.map.credit ? `${store.map.credit}. ${store.map.licence}.` : ''
}
store.listen(() => {
  $('undo').disabled = !store.canUndo
  $('redo').disabled = !store.canRedo
})

bindTheme()
bindTips()
bindTabs()
start().catch(fail)
