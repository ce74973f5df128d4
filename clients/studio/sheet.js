// The page section 'What each model does': the relief in hand with every model, under a sun at six elevations, without and
// with highlights. Its pictures are the server's, asked for when it is opened and not before.
import { listedMedium } from './media.js'
import { caution, elevations, explainingScene, models, withHighlight, withModel } from './models.js'
import { shortened } from './scene.js'
import { card, thumbnailOutput } from './thumbnails.js'
import { make } from './widgets.js'

const lines = [
  { shines: false, title: 'Without highlights' },
  { shines: true, title: 'With highlights' },
]

/** @param ask  of thumbnails.js, of a queue of its own @param media  of GET /v1/media */
export function bindModels(store, client, catalogue, ask, media) {
  const dialog = document.getElementById('models')
  const list = document.getElementById('models-list')

  function picture(model, { shines, title }, elevation) {
    const { button, img } = card(`${elevation}°`)
    button.removeAttribute('aria-pressed')
    button.setAttribute('aria-label', `${model.title}, ${title.toLowerCase()}, sun at ${elevation}°`)
    button.addEventListener('click', () => {
      dialog.close()
      store.change(withHighlight(withModel(store.scene, model.name), shines))
    })
    const scene = explainingScene(store.scene, model.name, elevation, shines)
    const output = { ...thumbnailOutput(scene, catalogue.defaults), accuracy: 'preview' }
    const url = client.url(shortened({ ...scene, output }, catalogue.defaults))
    return { button, load: () => ask(img, url) }
  }

  function section(model) {
    const rows = lines.map((line) => {
      const pictures = elevations.map((elevation) => picture(model, line, elevation))
      return { line, pictures }
    })
    const isOn = store.scene.material.model === model.name
    const id = `model-${model.name}`
    const head = make('h3', { id }, model.title, isOn ? make('span', { className: 'on' }, 'in this scene') : null)
    const root = make(
      'section',
      { className: 'model', 'aria-labelledby': id },
      make('div', { className: 'words' }, head, make('p', { className: 'note' }, model.by), make('p', {}, model.does)),
      make(
        'div',
        { className: 'strips' },
        rows.map(({ line, pictures }) =>
          make(
            'div',
            { className: 'strip', role: 'group', 'aria-label': `${model.title}, ${line.title.toLowerCase()}` },
            make('p', { className: 'note' }, line.title),
            make('div', { className: 'cards' }, pictures.map(({ button }) => button)),
          ),
        ),
      ),
    )
    return { root, pictures: rows.flatMap(({ pictures }) => pictures) }
  }

  function open() {
    const { material } = store.scene
    const medium = listedMedium(material.medium, media)?.title ?? 'one of its own'
    document.getElementById('models-of').textContent =
      `This relief under a sun at six heights. Medium of all but the first: ${medium}, ${material.mmPerWidth} mm wide; ` +
      'the colours of the scene tint it. Choose a picture to take its model; your lights stay.'
    document.getElementById('models-caution').textContent = caution
    const sections = models.map(section)
    list.replaceChildren(...sections.map(({ root }) => root))
    dialog.showModal()
    for (const { pictures } of sections) for (const one of pictures) one.load()
  }

  document.getElementById('models-open').addEventListener('click', () => store.scene && open())
  document.getElementById('models-close').addEventListener('click', () => dialog.close())
  dialog.addEventListener('click', (event) => event.target === dialog && dialog.close())
  dialog.addEventListener('close', () => list.replaceChildren()) // what is still to be asked for is not
}
