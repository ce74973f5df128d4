// MIT, see index.d.ts
const { min, max, hypot, atan2, round, PI } = Math
const clamp = (x, low, high) => min(max(x, low), high)

export class RelitError extends Error {
  constructor(message, status = 0, problem, retryAfter = 0) {
    const code = problem?.type?.split('/').pop()
    const temporary = [0, 429, 502, 503, 507].includes(status)
    Object.assign(super(message), { status, code, problem, retryAfter, temporary })
  }
}

async function checked(answer, options) {
  const reply = await answer.catch((error) => {
    throw options?.signal?.aborted ? error : new RelitError((options?.src ?? 'The server') + ' does not answer.')
  })
  const { ok = true, status, headers } = reply
  if (ok) return reply
  const problem = await reply.json().catch(() => {})
  throw new RelitError(problem?.detail ?? 'Status ' + status, status, problem, +headers.get('Retry-After') || 0)
}

const post = (scene, { session, ...options } = {}) => ({
  ...options,
  method: 'POST',
  body: JSON.stringify(scene),
  headers: { 'Content-Type': 'application/json', ...(session && { 'Relit-Session': session }) },
})

export class Relit {
  constructor(server, { key } = {}) {
    this.key = key
    this.server = (server ?? new URL('.', import.meta.url).href).replace(/\/+$/, '')
  }
  fetch(path, options) {
    const headers = new Headers(options?.headers)
    if (this.key) headers.set('Authorization', 'Bearer ' + this.key)
    return checked(fetch(this.server + path, { ...options, headers }), options)
  }
  async get(path, options) {
    return (await this.fetch(path, options)).json()
  }
  upload(image, options) {
    return this.get('/v1/images', { ...options, method: 'POST', body: image })
  }
  async scene(scene, options) {
    const reply = await this.fetch('/v1/scene', post(scene, options))
    return { etag: reply.headers.get('ETag'), scene: await reply.json() }
  }
  async render(scene, options) {
    const begin = performance.now()
    const reply = await this.fetch('/v1/render', post(scene, options))
    const head = performance.now()
    const blob = await checked(reply.blob(), options)
    const total = performance.now() - begin
    const timing = { total, network: total, transfer: total + begin - head }
    const header = (name) => reply.headers.get(name)
    for (const [, stage, ms] of (header('Server-Timing') ?? '').matchAll(/(\w+);dur=([\d.]+)/g)) timing.network -= timing[stage] = +ms
    return { blob, etag: header('ETag'), accuracy: header('Relit-Accuracy'), timing }
  }
  url(scene) {
    return this.server + '/v1/render?scene=' + btoa(unescape(encodeURIComponent(JSON.stringify(scene)))).replace(/\+/g, '-').replace(/\//g, '_')
  }
}

const all = [0, 0, 1, 1]
const turn = (angle) => 180 - ((((180 - angle) % 360) + 360) % 360)
const rounded = (numbers) => numbers.map((x) => +x.toFixed(4))
const isPoint = ({ type }) => type === 'point'
const isSun = ({ type }) => type === 'directional'
const place = ({ position = [0.1, 1, 0.6] }) => position

export const handledIndex = (lights) => max(0, lights.findIndex(isPoint))

export function sunAngles({ direction, azimuth = 315, elevation = 35 }) {
  if (!direction) return [azimuth, elevation]
  const [x, y, z] = direction
  return [((atan2(x, y) / PI + 2) % 2) * 180, (atan2(z, hypot(x, y)) / PI) * 180]
}
const angles = (light) => (isSun(light) ? sunAngles(light) : light.rotation ?? all)

export function handlePosition(light, [w, h], [left, top, across, down] = all) {
  const [x, y] = isPoint(light) ? place(light) : angles(light)
  if (isPoint(light)) return [((x - left) / across) * w, ((1 - y - top) / down) * h]
  if (!isSun(light)) return [(turn(x) / 360 + 0.5) * w, (clamp(turn(y), -90, 90) / 180 + 0.5) * h]
  const away = min(w, h) * (0.5 - y / 180)
  return [w / 2 + away * Math.sin((x / 180) * PI), h / 2 - away * Math.cos((x / 180) * PI)]
}

export function lightAt({ direction, ...light }, [x, y], [w, h], [left, top, across, down] = all) {
  if (isPoint(light))
    return { ...light, position: rounded([left + (x / w) * across, 1 - top - (y / h) * down, place(light)[2]]) }
  if (!isSun(light))
    return { ...light, rotation: rounded([turn((x / w) * 360 - 180), clamp((y / h) * 180 - 90, -90, 90)]) }
  const away = [x - w / 2, h / 2 - y, 0]
  const up = 90 - (hypot(...away) / min(w, h)) * 180
  const [azimuth, elevation] = rounded([sunAngles({ direction: away })[0], max(-90, up)])
  return { ...light, azimuth, elevation }
}

export function spokenLight(light) {
  const [a, b, z] = isPoint(light) ? place(light) : angles(light).map(round)
  if (isSun(light)) return `azimuth ${a}°, elevation ${b}°`
  return light.image ? `turned ${a}°, tilted ${b}°` : `${round(a * 100)} % from the left, ${round(b * 100)} % up, ${z} near`
}

export const nextScale = (scale, { network, transfer, render, encode }) =>
  clamp(scale * (max(11, (network - transfer) / 2) / (render + encode + transfer)) ** 0.2, 0.2, 1)

const css = `:host(:not([hidden])){display:block;position:relative}
canvas{display:block;width:100%;height:100%;cursor:crosshair;touch-action:none}
b{top:0;left:0;width:24px;aspect-ratio:1;box-sizing:border-box;position:absolute;border:2px solid #fff;border-radius:50%;background:var(--relit-light);box-shadow:0 0 0 2px #000a;cursor:grab;touch-action:none}`
const keys = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1], PageUp: [0, 0, 1], PageDown: [0, 0, -1] }
const partial = ({ preset, lights }) => !!preset || !lights?.[0]

function mount(host) {
  const root = host.attachShadow({ mode: 'open' })
  const sheet = new CSSStyleSheet()
  sheet.replaceSync(css)
  root.adoptedStyleSheets = [sheet]
  root.innerHTML = `<canvas part=picture role=img></canvas><b part=handle role=slider tabindex=0 aria-label=Light hidden></b>`
  const [canvas, handle] = root.children
  const session = Math.random()
  let scene = null
  let scale = 1
  let failures = 0
  let map, active, pixels, moved, grip, slow, newest, waiting, running, resting, again, lost, alt, src, server, key, json, preset, point, sun, env

  const tell = (type, detail) => host.dispatchEvent(new CustomEvent('relit-' + type, { detail, bubbles: true }))
  const index = () => (scene?.lights[active] ? active : handledIndex(scene?.lights ?? []))
  const light = () => scene.lights[index()]
  const tellLight = (rest) => tell('light', { scene, light: light(), index: index(), rest })
  const size = () => [canvas.clientWidth, canvas.clientHeight]
  const width = () => round(canvas.clientWidth * devicePixelRatio)
  const region = () => scene.output?.region ?? [0, 0, map.width, map.height]
  const crop = () => region().map((at, i) => at / (i % 2 ? map.height : map.width))

  function locate() {
    if (!map || !scene) return
    sheet.cssRules[0].style.aspectRatio = region()[2] / region()[3]
    const { color = '#fff' } = light()
    const [x, y] = handlePosition(light(), size(), crop()).map((at, i) => clamp(at, -18, size()[i] + 18))
    handle.hidden = false
    handle.style.translate = `calc(${x}px - 50%) calc(${y}px - 50%)`
    handle.style.setProperty('--relit-light', color.map ? `color(srgb-linear ${color.join(' ')})` : color)
    handle.ariaValueNow = round((x / canvas.clientWidth) * 100)
    handle.ariaValueText = spokenLight(light())
    return [x, y]
  }

  function ask(next, final = partial(next)) {
    newest = next
    if (!partial(next)) scene = next
    locate()
    pixels = width()
    if (!pixels) return host.connectedCallback()
    host.ariaBusy = true
    if (running?.final || running?.scene.height?.image !== next.height?.image) running?.abort()
    waiting = { scene: next, final }
    clearTimeout(resting)
    resting = !final && setTimeout(settle, 150)
    if (final && moved) tellLight(!(moved = false))
    work()
  }
  const settle = () => resting && ask(scene, true)
  async function work() {
    if (running || again || !waiting) return
    const job = waiting
    waiting = null
    running = Object.assign(new AbortController(), job)
    const { signal } = running
    try {
      const drawn = await render(job, signal)
      const bitmap = await createImageBitmap(drawn.blob)
      signal.throwIfAborted()
      const { width, height } = bitmap
      canvas.getContext('bitmaprenderer').transferFromImageBitmap(bitmap)
      slow = drawn.timing.transfer > 20
      if (!job.final) scale = nextScale(scale, drawn.timing)
      else host.ariaBusy = !!waiting
      if (failures) tell('recovery', (failures = 0))
      tell('frame', { ...drawn, ...job, width, height })
    } catch (error) {
      const late = error.code === 'superseded'
      if (!signal.aborted) {
        const wait = late ? 50 : error.temporary ? 1000 * max(min(2 ** failures / 4, 8), error.retryAfter) : null
        if (wait) {
          waiting ??= job
          again = setTimeout(() => work((again = 0)), wait)
        } else host.ariaBusy = !!waiting
        if (!late) tell('error', { error, again: wait }, ++failures)
      }
    }
    running = null
    work()
  }
  async function render(job, signal) {
    await null
    const { client } = host
    let next = job.scene
    if (!next.height && src) {
      const file = await checked(fetch(src), { src }).catch((error) => {
        error.temporary &&= ++lost < 6
        throw error
      })
      next = { ...next, height: { image: (await client.upload(await file.blob(), { signal })).id } }
    }
    if (partial(next) || !next.height) {
      const { light, ...whole } = (await client.scene(next, { signal })).scene
      next = { lights: [light], ...whole }
    }
    const { image } = next.height
    if (map?.id !== image) host.map = map = await client.get('/v1/images/' + image, { signal })
    if (newest === job.scene) newest = scene = next
    job.scene = next
    locate()
    pixels = width()
    const output = { ...next.output, accuracy: 'final', format: 'png', effort: 'fast', bitDepth: null, width: pixels, height: null }
    if (!job.final) {
      output.accuracy = 'preview'
      output.width = Math.ceil((scale * min(pixels, region()[2])) / 16) * 16
      if (output.background || (!next.alpha && map.channels % 2 && map.type[0] === 'u')) output.format = 'jpeg'
      if (slow) output.format = 'webp'
    }
    return client.render({ ...next, output }, { signal, session })
  }

  function move(lamp) {
    moved = true
    ask({ ...scene, lights: scene.lights.with(index(), lamp) })
    tellLight(false)
  }
  const moveTo = (x, y) => move(lightAt(light(), [x, y], size(), crop()))
  const on = (type, listener) => root.addEventListener(type, (event) => event.defaultPrevented || listener(event))
  on('pointerdown', (event) => {
    if (!event.isPrimary || event.button || handle.hidden) return
    event.preventDefault()
    handle.focus({ preventScroll: true })
    canvas.setPointerCapture(event.pointerId)
    const held = event.target === handle || light().image
    const [x, y] = held ? locate() : [event.offsetX, event.offsetY]
    grip = [x - event.clientX, y - event.clientY]
    if (!held) moveTo(x, y)
  })
  on('pointermove', (event) => {
    if (event.isPrimary && grip) moveTo(event.clientX + grip[0], event.clientY + grip[1])
  })
  on('lostpointercapture', () => settle((grip = null)))
  on('keydown', (event) => {
    if (!keys[event.key] || event.altKey || event.ctrlKey || event.metaKey) return
    event.preventDefault()
    const [right, down, near] = keys[event.key].map((step) => step * (event.shiftKey ? 0.1 : 0.02))
    const [x, y] = handlePosition(light(), size(), crop())
    if (!near) moveTo(x + right * canvas.clientWidth, y + down * canvas.clientWidth)
    else if (isPoint(light()))
      move({ ...light(), position: rounded(place(light()).map((at, i) => at + (i > 1 && near))) })
  })

  Object.defineProperties(host, {
    scene: { get: () => scene, set: (next) => next && ask(next) },
    active: { get: index, set: (i) => locate((active = i)) },
  })
  const resized = new ResizeObserver(() => (newest && width() !== pixels ? ask(newest) : locate()))
  return (changed) => {
    clearTimeout(resting)
    clearTimeout(again)
    waiting = again = pixels = null
    running?.abort()
    resized.disconnect()
    if (changed) newest = lost = null
    if (!host.isConnected) return
    resized.observe(host)
    ;[alt, src, server, key, json, preset, point, sun, env] = attributes.map((name) => host.getAttribute(name))
    canvas.ariaLabel = alt
    if (newest) return
    if (/server|key/.test(changed) || !host.client) host.client = new Relit(server, { key })
    const words = (point ?? sun ?? env)?.split(',')
    const next = { ...JSON.parse(json) }
    if (src) next.height = /^[\da-f]{64}$/.test(src) && { image: src }
    if (preset) next.preset = preset
    if (words) {
      const [azimuth, elevation, z] = words.map(Number)
      delete next.lights
      next.light = { type: 'environment', image: { image: words[0] }, rotation: [elevation, z] }
      if (sun) next.light = { type: 'directional', azimuth, elevation }
      if (point) next.light = { type: 'point', position: [azimuth, elevation, z] }
    }
    if (src || next.height) ask(next)
  }
}

const attributes = 'alt src server key scene preset light sun env'.split(' ')
export class RelitImage extends (globalThis.HTMLElement ?? Object) {
  static observedAttributes = attributes.slice(1)
  #start = mount(this)
  connectedCallback() {
    this.#start()
  }
  disconnectedCallback() {
    this.#start()
  }
  attributeChangedCallback(name) {
    this.#start(name)
  }
}
globalThis.customElements?.define('relit-image', RelitImage)
