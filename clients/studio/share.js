// What leaves the studio: the link in the address bar, words to paste, and the picture's file.
import { layerNames } from './controls.js'
import { hasLayer } from './models.js'
import { imagesOf, same, shortened } from './scene.js'
import { fileName, snippetsOf } from './snippets.js'
import { make, segments } from './widgets.js'

/** [width, height] of the picture's file in pixels. */
function pictureSize({ output }, map) {
  const [, , w, h] = output.region ?? [0, 0, map.width, map.height]
  if (output.width && output.height) return [output.width, output.height]
  if (output.width) return [output.width, Math.max(1, Math.round((output.width * h) / w))]
  if (output.height) return [Math.max(1, Math.round((output.height * w) / h)), output.height]
  return [w, h]
}

// Of the output, what the element takes; the rest it sets by itself.
function elementScene(scene, defaults) {
  const { format, bitDepth, quality, effort, width, height, accuracy, ...look } = scene.output
  return shortened({ ...scene, output: { ...defaults.scene.output, ...look } }, defaults)
}

async function copied(text, field) {
  const done = await navigator.clipboard?.writeText(text).then(
    () => true,
    () => false,
  )
  if (done) return true
  field.select() // an address without https has no clipboard, but the older way
  return document.execCommand('copy')
}

/** @param catalogue  {samples: ids, defaults} */
export function bindShare(store, client, catalogue, stage, say, fail) {
  const dialog = document.getElementById('share')
  const text = document.getElementById('snippet')
  const note = document.getElementById('snippet-note')
  const copy = document.getElementById('copy')
  const server = new URL(client.server, location.href).href.replace(/\/$/, '')
  let all = []
  let current = 'link'

  const wordOf = (url) => url.match(/scene=[\w-]+/)[0]
  const link = () =>
    `${location.origin}${location.pathname}#${wordOf(client.url(shortened(store.scene, catalogue.defaults)))}`
  function snippets() {
    const { scene, map } = store
    const short = shortened(scene, catalogue.defaults)
    return snippetsOf(short, {
      server,
      name: map.title ?? 'relief',
      file: map.name ?? map.title ?? 'relief',
      format: scene.output.format,
      samples: catalogue.samples,
      images: imagesOf(scene),
      url: new URL(client.url(short), location.href).href,
      link: link(),
      element: elementScene(scene, catalogue.defaults),
      size: pictureSize(scene, map),
      keyed: !!client.key,
    })
  }

  let tabs = null
  function open(name = 'link') {
    all = snippets()
    tabs ??= segments(
      'Copy as',
      all.map(({ name, title }) => [name, title]),
      choose,
    )
    document.getElementById('snippet-kinds').replaceChildren(tabs.root)
    choose(name)
    if (!dialog.open) dialog.showModal()
  }
  function choose(name) {
    current = name
    tabs.show(name)
    const snippet = all.find((one) => one.name === name)
    text.value = snippet.text
    note.textContent = snippet.note
    copy.textContent = 'Copy'
  }
  copy.addEventListener('click', async () => {
    copy.textContent = (await copied(text.value, text)) ? 'Copied' : 'Press Ctrl+C'
    text.dataset.copied = current
  })
  document.getElementById('share-open').addEventListener('click', () => store.scene && open())
  document.getElementById('copy-as').addEventListener('click', () => store.scene && open('scene'))
  document.getElementById('share-close').addEventListener('click', () => dialog.close())
  dialog.addEventListener('click', (event) => event.target === dialog && dialog.close())

  // ---- the part of the map that the file shows

  const part = segments(
    'Part',
    [
      ['whole', 'All'],
      ['shown', 'What is shown'],
    ],
    (word) => {
      const region = word === 'shown' ? stage.region() : null
      if (word === 'shown' && !region) say('All of the map is shown: zoom in first.')
      store.change({ ...store.scene, output: { ...store.scene.output, region } })
      show()
    },
  )
  document.getElementById('part').append(part.root)

  // ---- the file

  const button = document.getElementById('download')
  const progress = document.getElementById('download-progress')
  let abort = null
  async function download() {
    if (abort) return abort.abort()
    abort = new AbortController()
    const { scene, map } = store
    button.textContent = 'Cancel'
    progress.hidden = false
    progress.removeAttribute('value')
    try {
      const blob = await received(
        await client.fetch('/v1/render', {
          method: 'POST',
          signal: abort.signal,
          headers: { 'Content-Type': 'application/json' },
          body: JSON.stringify(scene),
        }),
      )
      const anchor = make('a', {
        href: URL.createObjectURL(blob),
        download: fileName(map.name ?? map.title ?? 'relief', scene.output.format),
      })
      anchor.click()
      setTimeout(() => URL.revokeObjectURL(anchor.href), 60000)
      say(`${anchor.download} is saved: ${(blob.size / 1e6).toFixed(2)} MB.`)
    } catch (error) {
      if (!abort.signal.aborted) fail(error)
    }
    abort = null
    progress.hidden = true
    show()
  }
  async function received(reply) {
    const total = Number(reply.headers.get('Content-Length'))
    const parts = []
    let count = 0
    for (let reader = reply.body.getReader(), piece; !(piece = await reader.read()).done; ) {
      parts.push(piece.value)
      count += piece.value.length
      if (total) progress.value = count / total
    }
    return new Blob(parts, { type: reply.headers.get('Content-Type') })
  }
  button.addEventListener('click', () => store.scene && download())
  document.getElementById('download-top').addEventListener('click', () => store.scene && download())

  // ---- layers

  const layers = document.getElementById('layer')
  layers.append(...Object.entries(layerNames).map(([value, name]) => make('option', { value }, name)))
  layers.addEventListener('change', () =>
    store.change({ ...store.scene, output: { ...store.scene.output, layer: layers.value } }),
  )

  function show() {
    if (!store.scene) return
    const { output } = store.scene
    const [width, height] = pictureSize(store.scene, store.map)
    if (!abort) button.textContent = `Download ${output.format.toUpperCase()}`
    document.getElementById('file-size').textContent = `${width} × ${height} pixels`
    part.show(output.region ? 'shown' : 'whole')
    for (const option of layers.options) option.disabled = !hasLayer(store.scene, option.value)
    layers.value = output.layer
  }

  let late = null
  /** The address follows the scene, once it rests. */
  function address() {
    clearTimeout(late)
    late = setTimeout(() => {
      const next = link()
      if (!same(next, location.href)) history.replaceState(null, '', next)
    }, 350)
  }
  return { show, address, snippets }
}
