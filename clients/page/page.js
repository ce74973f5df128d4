// The page at /: controls hold a scene, the server renders it, the handle moves its light.
import { handledIndex, handlePosition, horizonRadius, lightAt, spokenLight, sunAngles, withinReach } from './light.js'
import { decodeScene, encodeScene, finalOf, heldScene, hexColour, member, previewOf, withMember } from './scene.js'
import { frameStream, Refusal, request } from './frames.js'

const clamp = (number, low, high) => Math.min(Math.max(number, low), high)
const $ = (id) => document.getElementById(id)
const reach = 18 // pixels round the picture where the handle of a light outside it stays
const widest = 2048 // pixels of a picture on the page; the download has all texels
const session = Array.from(crypto.getRandomValues(new Uint8Array(12)), (b) => b.toString(16).padStart(2, '0')).join('')

let scene = null // whole, as scene.js holds it
let map = null // {id, width, height} of its height map
let presets = []
const reliefs = new Map() // by id: {id, width, height}, and of samples what is said of them
let coarseness = 1 // texels of the map to a pixel of a preview, along a side

// ---- the server

const ask = (path, options) => request(fetch, path, options)
const askJson = async (path, options) => (await ask(path, options)).json()
const asJson = (value) => ({
  method: 'POST',
  headers: { 'Content-Type': 'application/json' },
  body: JSON.stringify(value),
})

async function render(job, signal) {
  const options = asJson(job.scene)
  options.headers['Relit-Session'] = session
  job.asked = performance.now()
  const reply = await ask('/v1/render', { ...options, signal })
  return createImageBitmap(await reply.blob())
}

// Tries again for as long as that may help and `wanted()` holds.
async function patiently(work, wanted = () => true) {
  for (;;) {
    try {
      return await work()
    } catch (refusal) {
      if (refusal.again_ms == null || !wanted()) throw refusal
      say(refusal.message, 'wait')
      await new Promise((done) => setTimeout(done, refusal.again_ms))
    }
  }
}

// ---- what is said and shown

// Kinds: `frame`, until a picture comes; `wait`, until an answer comes; `choice`, until the scene changes.
function say(sentence, kind = 'choice') {
  $('message').textContent = sentence
  $('message').dataset.kind = kind
}
function unsay(...kinds) {
  if (kinds.includes($('message').dataset.kind)) say('', '')
}

const busy = (is) => $('stage').setAttribute('aria-busy', is)

function show(bitmap, job) {
  const took_ms = performance.now() - job.asked
  $('picture').getContext('bitmaprenderer').transferFromImageBitmap(bitmap)
  $('timing').textContent = `${job.final ? 'final' : 'preview'} ${Math.round(took_ms)} ms`
  if (job.final) busy(false)
  // Work grows with the texels, so that a slow light is dragged over a coarser picture.
  else coarseness = clamp(coarseness * clamp(Math.sqrt(took_ms / 60), 0.7, 2), 1, 6)
}

const askFrame = frameStream({
  render,
  show,
  fail: (refusal) => {
    if (!refusal) return unsay('frame', 'wait')
    say(refusal.message, 'frame')
    if (refusal.again_ms == null) busy(false)
  },
})

const frameSize = () => [$('frame').clientWidth, $('frame').clientHeight]
const stageColour = () => getComputedStyle($('stage')).getPropertyValue('--stage').trim()

function refresh() {
  if (!scene) return
  busy(true)
  const pixels = clamp(Math.round(frameSize()[0] * devicePixelRatio), 1, widest)
  const preview = previewOf(scene, Math.ceil(Math.min(pixels, map.width / coarseness)), stageColour())
  askFrame({ scene: preview, subject: map.id }, { scene: finalOf(scene, pixels), subject: map.id })
  showHandle()
  showControls()
  showLinks()
}

function change(next) {
  unsay('wait', 'choice')
  scene = next
  refresh()
}

const light = () => scene.lights[handledIndex(scene.lights)]
const changeLight = (next) => change(withMember(scene, `lights.${handledIndex(scene.lights)}`, next))

function isBehind(light) {
  if (light.type === 'point') return light.position[2] < 0
  return light.type === 'directional' && sunAngles(light)[1] < 0
}

function showHandle() {
  const size = frameSize()
  const position = handlePosition(light(), size)
  const shown = withinReach(position, size, reach)
  const handle = $('light')
  handle.hidden = false
  handle.style.translate = `${shown[0]}px ${shown[1]}px`
  handle.style.setProperty('--light', light().color ? hexColour(light().color) : '#fff')
  handle.classList.toggle('behind', isBehind(light()))
  handle.classList.toggle('outside', shown.some((number, axis) => number !== position[axis]))
  handle.setAttribute('aria-valuenow', Math.round((shown[0] / size[0]) * 100))
  handle.setAttribute('aria-valuetext', spokenLight(light()))
  $('horizon').hidden = light().type !== 'directional'
  $('horizon').style.width = $('horizon').style.height = `${2 * horizonRadius(size)}px`
}

const shownNumber = (number) => (Math.abs(number) < 0.1 ? String(Number(number.toPrecision(2))) : number.toFixed(2))

function showControl(input, value) {
  input.disabled = value == null || value === 'auto'
  if (input.type === 'color') {
    if (!input.disabled) input.value = hexColour(value)
    return
  }
  const text = input.disabled ? value ?? '' : shownNumber(value)
  input.nextElementSibling.textContent = text
  if (input.disabled) return
  input.value = 'log' in input.dataset ? Math.log10(value) : value
  input.setAttribute('aria-valuetext', text)
}

function showControls() {
  for (const input of document.querySelectorAll('[data-path]')) showControl(input, member(scene, input.dataset.path))
  for (const input of document.querySelectorAll('[data-light]')) showControl(input, member(light(), input.dataset.light))
  $('back').checked = scene.base !== 'none'
  $('kind').value = light().image?.image ?? light().type
}

function showLinks() {
  const picture = { ...scene, output: { ...scene.output, format: 'png' } }
  $('download').href = `/v1/render?scene=${encodeScene(picture)}`
  $('link').href = `#scene=${encodeScene(scene)}`
}

// ---- choosing a relief, a preset, a light

let choices = 0

// Takes the scene that the server makes of `partial`, unless something else is chosen meanwhile.
async function choose(partial, relief) {
  const choice = ++choices
  const whole = await patiently(() => askJson('/v1/scene', asJson(partial)), () => choice === choices)
  if (choice !== choices) return
  map = relief
  $('frame').style.setProperty('--aspect', map.width / map.height)
  change(heldScene(whole))
}

// What goes wrong is a sentence on the page.
const told = (work) => (...given) => {
  busy(true)
  return work(...given).catch((error) => {
    busy(false)
    if (!(error instanceof Refusal)) throw error
    say(error.message)
  })
}

function addRelief(relief, title) {
  if (reliefs.has(relief.id)) return
  reliefs.set(relief.id, relief)
  $('sample').append(new Option(title, relief.id))
}

// A sample suggests a scene; a relief of one's own is lit as the one before it.
const chooseRelief = told(async (id) => {
  const relief = reliefs.get(id)
  showNotes(id, relief.scene ? relief.scene.preset : $('preset').value)
  await choose({ ...(relief.scene ?? scene), height: { image: id } }, relief)
})

const choosePreset = told(async (name) => {
  showNotes(map.id, name)
  if (name === '') await chooseRelief(map.id)
  else await choose({ preset: name, height: scene.height }, map)
})

const chooseFile = told(async (file) => {
  say(`Sending ${file.name} …`)
  const image = await askJson('/v1/images', { method: 'POST', body: file })
  addRelief(image, file.name)
  await chooseRelief(image.id)
})

const chooseLink = told(async (word) => {
  const linked = decodeScene(word)
  const id = linked?.height?.image
  if (!id) throw new Refusal('The link holds no scene.')
  if (!reliefs.has(id)) addRelief(await askJson(`/v1/images/${encodeURIComponent(id)}`), 'from the link')
  showNotes(id, '')
  await choose(linked, reliefs.get(id))
})

function showNotes(id, preset = '') {
  const { credit, licence } = reliefs.get(id)
  $('sample').value = id
  $('preset').value = preset
  $('sentence').textContent = presets.find(({ name }) => name === preset)?.description ?? ''
  $('credit').textContent = credit ? `${credit}. ${licence}.` : ''
}

const kinds = {
  point: { type: 'point', position: [0.15, 0.95, 0.6], color: '#ffffff', intensity: 1.1 },
  directional: { type: 'directional', azimuth: 315, elevation: 35, color: '#ffffff', intensity: 1.1 },
}

function chooseKind(kind) {
  changeLight(kinds[kind] ?? { type: 'environment', image: { image: kind }, rotation: [0, 0], intensity: 'auto' })
}

// ---- hands

function bindHandle() {
  const frame = $('frame')
  let grip = null // from the pointer to the handle

  const pointer = (event) => {
    const box = frame.getBoundingClientRect()
    return [event.clientX - box.left, event.clientY - box.top]
  }
  const drag = (event) => {
    const [x, y] = pointer(event)
    changeLight(lightAt(light(), [x + grip[0], y + grip[1]], frameSize()))
  }
  frame.addEventListener('pointerdown', (event) => {
    if (!scene || event.button !== 0 || grip) return
    const [x, y] = pointer(event)
    const handle = withinReach(handlePosition(light(), frameSize()), frameSize(), reach)
    // An environment turns from where it is taken; a light comes to the pointer, unless it is taken by its handle.
    const held = event.target === $('light') || light().type === 'environment'
    grip = held ? [handle[0] - x, handle[1] - y] : [0, 0]
    frame.setPointerCapture(event.pointerId)
    document.body.classList.add('dragging')
    $('light').focus({ preventScroll: true, focusVisible: false })
    event.preventDefault()
    if (!held) drag(event)
  })
  frame.addEventListener('pointermove', (event) => {
    if (grip && frame.hasPointerCapture(event.pointerId)) drag(event)
  })
  frame.addEventListener('lostpointercapture', () => {
    grip = null
    document.body.classList.remove('dragging')
  })
}

const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }
const pages = { PageUp: 0.05, PageDown: -0.05 }

function pressKey(event) {
  if (!scene || event.ctrlKey || event.metaKey || event.altKey) return
  const size = frameSize()
  if (arrows[event.key]) {
    const step = size[0] * (event.shiftKey ? 0.1 : 0.02)
    const [x, y] = handlePosition(light(), size)
    const [right, down] = arrows[event.key]
    changeLight(lightAt(light(), [x + right * step, y + down * step], size))
  } else if (pages[event.key] && light().type === 'point') {
    const z = Number((light().position[2] + pages[event.key]).toFixed(4))
    changeLight(withMember(light(), 'position.2', z))
  } else return
  event.preventDefault()
}

const chosenValue = (input) => {
  if (input.type === 'color') return input.value
  return 'log' in input.dataset ? Number((10 ** input.value).toPrecision(3)) : Number(input.value)
}

function bindControls() {
  $('controls').addEventListener('submit', (event) => event.preventDefault())
  $('controls').addEventListener('input', ({ target }) => {
    if (!scene) return
    const { path, light: part } = target.dataset
    if (path) change(withMember(scene, path, chosenValue(target)))
    if (part) changeLight(withMember(light(), part, chosenValue(target)))
  })
  $('sample').addEventListener('change', ({ target }) => chooseRelief(target.value))
  $('preset').addEventListener('change', ({ target }) => choosePreset(target.value))
  $('kind').addEventListener('change', ({ target }) => chooseKind(target.value))
  $('back').addEventListener('change', ({ target }) => change({ ...scene, base: target.checked ? 'auto' : 'none' }))
  $('file').addEventListener('change', ({ target }) => {
    if (target.files[0]) chooseFile(target.files[0])
    target.value = ''
  })
  $('light').addEventListener('keydown', pressKey)
  $('link').addEventListener('click', async (event) => {
    event.preventDefault()
    history.replaceState(null, '', $('link').href)
    const copied = await navigator.clipboard?.writeText(location.href).then(() => true, () => false)
    say(copied ? 'The link is copied.' : 'The link is in the address bar.')
  })
}

function bindDrop() {
  const dropping = (on) => document.body.classList.toggle('dropping', on)
  addEventListener('dragover', (event) => {
    event.preventDefault()
    dropping(true)
  })
  addEventListener('dragleave', (event) => event.relatedTarget || dropping(false))
  addEventListener('drop', (event) => {
    event.preventDefault()
    dropping(false)
    const [file] = event.dataTransfer.files
    if (file) chooseFile(file)
  })
}

// ---- from the beginning

const linkedWord = () => location.hash.match(/^#scene=([\w-]+)$/)?.[1]

async function start() {
  const [presetList, sampleList] = await patiently(() => Promise.all([askJson('/v1/presets'), askJson('/v1/samples')]))
  presets = presetList.presets
  for (const sample of sampleList.samples) {
    if (sample.kind === 'relief') addRelief(sample, sample.title)
    else $('kind').append(new Option(sample.title, sample.id))
  }
  $('preset').append(new Option('as the relief comes', ''), ...presets.map(({ name }) => new Option(name)))
  if (linkedWord()) await chooseLink(linkedWord())
  if (!scene) {
    const sentence = $('message').textContent // why the link's scene is not shown
    await chooseRelief(reliefs.keys().next().value)
    if (linkedWord()) say(sentence)
  }
}

bindHandle()
bindControls()
bindDrop()
addEventListener('hashchange', () => linkedWord() && chooseLink(linkedWord()))
new ResizeObserver(refresh).observe($('frame'))
told(start)()
