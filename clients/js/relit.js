// Relit: a client of relighting servers, and <relit-image>, whose light is dragged. Explained in index.d.ts. MIT licence.
const { min, max, hypot, atan2, PI } = Math
const clamp = (x, low, high) => min(max(x, low), high)

export class RelitError extends Error {
  constructor(message, status = 0, problem, retryAfter) {
    super(message)
    const code = problem?.type.split('/').pop()
    const temporary = [0, 429, 502, 503, 507].includes(status)
    Object.assign(this, { name: 'RelitError', status, code, problem, retryAfter, temporary })
  }
}

async function checked(answer, options) {
  const reply = await answer.catch((error) => {
    throw options?.signal?.aborted ? error : new RelitError('The server does not answer.')
  })
  const { ok = true, status, headers } = reply
  if (ok) return reply
  const problem = await reply.json().catch(() => {})
  throw new RelitError(problem?.detail ?? `The server answers ${status}.`, status, problem, +headers.get('Retry-After'))
}

const post = (scene, options, headers) => ({
  ...options,
  method: 'POST',
  body: JSON.stringify(scene),
  headers: { 'Content-Type': 'application/json', ...headers },
})

export class Relit {
  constructor(server = new URL('.', import.meta.url).href) {
    this.server = server.replace(/\/+$/, '')
  }
  fetch(path, options) {
    return checked(fetch(this.server + path, options), options)
  }
  async get(path, options) {
    return (await this.fetch(path, options)).json()
  }
  upload(image, options) {
    return this.get('/v1/images', { ...options, method: 'POST', body: new Blob([image]) })
  }
  async scene(scene, options) {
    const reply = await this.fetch('/v1/scene', post(scene, options))
    return { scene: await reply.json(), etag: reply.headers.get('ETag') }
  }
  async render(scene, options) {
    const begin = performance.now()
    const session = options?.session
    const reply = await this.fetch('/v1/render', post(scene, options, session && { 'Relit-Session': session }))
    const head = performance.now()
    const blob = await checked(reply.blob(), options)
    const end = performance.now()
    const timing = { total: end - begin, network: end - begin, transfer: end - head }
    const [etag, accuracy, stages] = ['ETag', 'Relit-Accuracy', 'Server-Timing'].map((name) => reply.headers.get(name))
    for (const [, stage, ms] of stages.matchAll(/(\w+);dur=([\d.]+)/g)) timing.network -= timing[stage] = +ms
    return { blob, etag, accuracy, timing }
  }
  url(scene) {
    const safe = { '+': '-', '/': '_', '=': '' }
    return `${this.server}/v1/render?scene=${btoa(JSON.stringify(scene)).replace(/[+/=]/g, (c) => safe[c])}`
  }
}

const all = [0, 0, 1, 1]
const turn = (angle) => 180 - ((((180 - angle) % 360) + 360) % 360) // the same, in (-180, 180]
const rounded = (numbers, digits = 2) => numbers.map((x) => +x.toFixed(digits))
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
  const [x, y] = place(light)
  if (isPoint(light)) return [((x - left) / across) * w, ((1 - y - top) / down) * h]
  const [a, b] = angles(light)
  if (!isSun(light)) return [(turn(a) / 360 + 0.5) * w, (clamp(turn(b), -90, 90) / 180 + 0.5) * h]
  const distance = min(w, h) * (0.5 - b / 180)
  return [w / 2 + distance * Math.sin((a / 180) * PI), h / 2 - distance * Math.cos((a / 180) * PI)]
}

export function lightAt({ direction, ...light }, [x, y], [w, h], [left, top, across, down] = all) {
  if (isPoint(light)) {
    const position = [left + (x / w) * across, 1 - top - (y / h) * down, place(light)[2]]
    return { ...light, position: rounded(position, 4) }
  }
  if (!isSun(light))
    return { ...light, rotation: rounded([turn((x / w) * 360 - 180), clamp((y / h) * 180 - 90, -90, 90)]) }
  const [a] = sunAngles({ direction: [x - w / 2, h / 2 - y, 0] })
  const b = 90 - (hypot(x - w / 2, y - h / 2) / min(w, h)) * 180
  const [azimuth, elevation] = rounded([a, max(-90, b)])
  return { ...light, azimuth, elevation }
}

export function spokenLight(light) {
  const [x, y, z] = place(light)
  const [a, b] = rounded(isPoint(light) ? [x * 100, y * 100] : angles(light), 0)
  if (isPoint(light)) return `${a} % from the left, ${b} % up, ${Math.abs(z)} ${z < 0 ? 'behind' : 'in front'}`
  return isSun(light) ? `azimuth ${a}°, elevation ${b}°` : `turned ${a}°, tilted ${b}°`
}

// The size of a drag's next picture: its work takes two thirds of a displayed frame, or half of the way there and back.
export const nextScale = (scale, { network, transfer, render, encode }) =>
  clamp(scale * clamp(Math.sqrt(max(11, (network - transfer) / 2) / (render + encode + transfer)), 0.7, 1.2), 0.1, 1)

const css = `:host{display:block;position:relative}
:host([hidden]){display:none}
canvas{display:block;width:100%;height:100%;touch-action:var(--relit-touch-action,none);cursor:crosshair}
b,i,p{position:absolute;margin:0}
b{width:var(--relit-handle-size,24px);aspect-ratio:1;transform:translate(-50%,-50%);box-sizing:border-box;border:2px solid #fff;border-radius:50%;background:var(--light);box-shadow:0 0 0 2px #000a;cursor:grab;touch-action:none}
b[part~=behind]{border-style:dotted}
i{inset:0;margin:auto;aspect-ratio:1;max-width:100%;max-height:100%;border:1px dashed #fff6;border-radius:50%;pointer-events:none}
p{bottom:0;background:#000c;color:#fff}`
const html = `<canvas part=picture role=img></canvas><i part=horizon></i>
<b part=handle role=slider tabindex=0 aria-label=Light></b><p part=message role=status></p>`
const keys = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1], PageUp: [0, 0, 1], PageDown: [0, 0, -1] }
const unprepared = ({ preset, lights }) => preset || !lights

export class RelitImage extends (globalThis.HTMLElement ?? Object) {
  #on
  static observedAttributes = ['src', 'server', 'scene', 'preset', 'light', 'sun', 'env', 'alt']

  constructor() {
    super()
    const root = this.attachShadow({ mode: 'open' })
    const sheet = new CSSStyleSheet() // a page's policy may refuse <style>
    sheet.replaceSync(css)
    root.adoptedStyleSheets = [sheet]
    root.innerHTML = html
    const [picture, horizon, handle, message] = root.children
    const session = Math.random().toString(36)
    let scene = null // what is shown, once it has lights
    let scale = 1
    let failures = 0
    let map, active, client, pixels, moved, grip, slow
    let newest, waiting, running, resting, again // jobs: {scene, final}

    const tell = (type, detail) =>
      this.dispatchEvent(new CustomEvent('relit-' + type, { detail, bubbles: true, composed: true, cancelable: true }))
    const index = () => active ?? handledIndex(scene.lights)
    const light = () => scene.lights[index()]
    const tellLight = (rest) => tell('light', { scene, light: light(), index: index(), rest })
    const size = () => [picture.clientWidth, picture.clientHeight]
    const width = () => Math.round(picture.clientWidth * devicePixelRatio)
    const region = () => scene.output?.region ?? [0, 0, map.width, map.height]
    const crop = () => region().map((texels, i) => texels / (i % 2 ? map.height : map.width))

    const locate = () => {
      handle.hidden = horizon.hidden = !map || !scene
      if (!map || !scene) return
      const [, , w, h] = region()
      sheet.cssRules[0].style.aspectRatio = w / h
      const lamp = light()
      const { color = '#fff' } = lamp
      const [x, y] = handlePosition(lamp, size(), crop()).map((at, i) => clamp(at, -18, size()[i] + 18))
      horizon.hidden = !isSun(lamp)
      handle.part.toggle('behind', (isPoint(lamp) ? place(lamp)[2] : isSun(lamp) && angles(lamp)[1]) < 0)
      handle.style.translate = `${x}px ${y}px`
      handle.style.setProperty('--light', color.map ? `color(srgb-linear ${color.join(' ')})` : color)
      handle.ariaValueNow = Math.round((x / size()[0]) * 100)
      handle.ariaValueText = spokenLight(lamp)
      return [x, y]
    }

    // Latest wins: one job is under way and one waits, whose place a newer one takes.
    const ask = (next, final = unprepared(next)) => {
      clearTimeout(resting)
      newest = next
      if (!unprepared(next)) scene = next
      locate()
      pixels = width()
      if (!pixels || !this.isConnected) return
      this.ariaBusy = true
      waiting = { scene: next, final }
      if (running?.final || running?.scene.height?.image !== next.height?.image) running?.abort()
      resting = final ? 0 : setTimeout(settle, 150)
      if (final && moved) tellLight(!(moved = false))
      work()
    }
    const settle = () => resting && ask(scene, true)
    const stop = () => {
      clearTimeout(resting)
      clearTimeout(again)
      waiting = again = pixels = 0
      running?.abort()
    }
    const work = async () => {
      if (running || again || !waiting) return
      const job = waiting
      const { signal } = (running = Object.assign(new AbortController(), job))
      waiting = 0
      try {
        const picture = await render(job, signal)
        const bitmap = await createImageBitmap(picture.blob)
        signal.throwIfAborted()
        const { width, height } = bitmap
        picture.getContext('bitmaprenderer').transferFromImageBitmap(bitmap)
        slow = picture.timing.transfer > 20
        if (job.final) this.ariaBusy = false
        else scale = nextScale(scale, picture.timing)
        message.textContent = ''
        if (failures) tell('recovery', (failures = 0))
        tell('frame', { ...picture, ...job, width, height })
      } catch (error) {
        if (!signal.aborted) {
          const overtaken = error.code === 'superseded' // by one that was given up before, but arrived later
          const wait = overtaken ? 50 : error.temporary ? max(250 * 2 ** min(failures, 5), error.retryAfter * 1000) : null
          if (wait) {
            waiting ||= job
            again = setTimeout(() => work((again = 0)), wait)
          } else this.ariaBusy = false
          failures += !overtaken
          if (!overtaken && tell('error', { error, again: wait })) message.textContent = error.message
        }
      }
      running = 0
      work()
    }
    const render = async (job, signal) => {
      const { client } = this
      const src = this.getAttribute('src')
      let next = job.scene
      if (!next.height && src) {
        const file = await checked(fetch(src, { signal }), { signal })
        next = { ...next, height: { image: (await client.upload(await file.blob(), { signal })).id } }
      }
      if (unprepared(next) || !next.height) {
        const { light, ...whole } = (await client.scene(next, { signal })).scene
        next = { lights: [light], ...whole }
      }
      const id = next.height.image
      if (map?.id !== id) map = await client.get('/v1/images/' + id, { signal })
      if (newest === job.scene) newest = scene = next
      job.scene = next
      locate()
      pixels = width()
      const { output, alpha } = next
      const opaque = output?.background || (!alpha && map.channels % 2 && map.type[0] === 'u')
      const fit = job.final
        ? { accuracy: 'final', format: 'png', width: pixels }
        : {
            accuracy: 'preview',
            format: slow ? 'webp' : opaque ? 'jpeg' : 'png',
            width: Math.ceil((min(pixels, region()[2]) * scale) / 16) * 16,
          }
      return client.render(
        { ...next, output: { ...output, bitDepth: null, height: null, effort: 'fast', ...fit } },
        { signal, session },
      )
    }

    const move = (lamp) => {
      moved = true
      ask({ ...scene, lights: scene.lights.map((other, i) => (i === index() ? lamp : other)) })
      tellLight(false)
    }
    const moveTo = (x, y) => move(lightAt(light(), [x, y], size(), crop()))
    const on = (type, listener) => root.addEventListener(type, (event) => event.defaultPrevented || listener(event))
    on('pointerdown', (event) => {
      const { target, clientX, clientY } = event
      if (grip || event.button || handle.hidden) return
      event.preventDefault()
      handle.focus({ preventScroll: true })
      picture.setPointerCapture(event.pointerId)
      // An environment turns from where it is taken; a light comes to the pointer, unless it is taken by its handle.
      const held = target === handle || light().image
      const [x, y] = held ? locate() : [event.offsetX, event.offsetY]
      grip = [x - clientX, y - clientY]
      if (!held) moveTo(x, y)
    })
    on('pointermove', ({ pointerId, clientX, clientY }) => {
      if (picture.hasPointerCapture(pointerId)) moveTo(clientX + grip[0], clientY + grip[1])
    })
    on('lostpointercapture', () => settle((grip = 0)))
    on('keydown', (event) => {
      const key = keys[event.key]
      if (!key || event.ctrlKey || event.metaKey || event.altKey) return
      event.preventDefault()
      const [right, down, near] = key.map((step) => step * (event.shiftKey ? 0.1 : 0.02))
      const lamp = light()
      const [w] = size()
      const [x, y] = handlePosition(lamp, size(), crop())
      if (!near) moveTo(x + right * w, y + down * w)
      else if (isPoint(lamp)) {
        const [x, y, z] = place(lamp)
        move({ ...lamp, position: rounded([x, y, z + near], 4) })
      }
    })

    const resized = new ResizeObserver(() => (newest && width() !== pixels ? ask(newest) : locate()))
    const start = () => {
      const [src, scene, preset, position, sun, env, server] = ['src', 'scene', 'preset', 'light', 'sun', 'env', 'server'].map((name) => this.getAttribute(name))
      stop()
      const next = JSON.parse(scene ?? '{}')
      if (src) next.height = /^[\da-f]{64}$/.test(src) ? { image: src } : undefined
      if (preset) next.preset = preset
      const [word, ...rest] = (position ?? sun ?? env ?? '').split(',')
      const [a, b] = rest.map(Number)
      if (word) delete next.lights
      if (position) next.light = { type: 'point', position: [+word, a, b] }
      else if (sun) next.light = { type: 'directional', azimuth: +word, elevation: a }
      else if (env) next.light = { type: 'environment', image: { image: word }, rotation: [a, b] }
      if (src || next.height) ask(next)
    }
    const changed = (name) => {
      picture.ariaLabel = this.getAttribute('alt')
      if (name === 'server') client = null
      if (name !== 'alt' && this.isConnected) start()
    }
    this.#on = { changed, connect: () => (resized.observe(this), newest || start()), disconnect: () => stop(resized.disconnect()) }
    Object.defineProperties(this, {
      scene: { get: () => scene, set: (next) => next && ask(next) },
      active: { get: index, set: (i) => locate((active = i)) },
      client: { get: () => (client ??= new Relit(this.getAttribute('server') ?? undefined)), set: (given) => (client = given) },
      map: { get: () => map },
    })
  }
  connectedCallback() {
    this.#on.connect()
  }
  disconnectedCallback() {
    this.#on.disconnect()
  }
  attributeChangedCallback(name) {
    this.#on.changed(name)
  }
}
globalThis.customElements?.define('relit-image', RelitImage)
