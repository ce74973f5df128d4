// Rows of a medium: its name out of a list or its numbers, and the optical size with how far light reaches. As widgets.js has
// its rows; `media` is {list: of GET /v1/media, fields: of readMediumFields()}.
import { mediumControls, shownNumber } from './controls.js'
import { listedMedium, numbersOf, reachOf, spokenShare } from './media.js'
import { make, newId, numberInput, numberWidget, row, takeTyped, tipOf } from './widgets.js'

const own = 'own' // of the list: a medium by its numbers
const colours = ['red', 'green', 'blue']
const figures = { log: true } // three digits are enough to read, of small numbers and large ones

function groupedBySource(list) {
  const sources = [...new Set(list.map(({ source }) => source))]
  return sources.map((source) =>
    make(
      'optgroup',
      { label: source },
      list.filter((one) => one.source === source).map(({ name, title }) => make('option', { value: name }, title)),
    ),
  )
}

/** A number of the medium: one, or one of each colour. */
function numberRow(name, field, current, tell) {
  const control = mediumControls[name]
  const isOne = name === 'eta'
  const inputs = (isOne ? [''] : colours).map((colour, c) => {
    const input = numberInput(control, field, `${control.label} ${colour}`.trim())
    const now = () => (isOne ? current().eta : current()[name][c])
    const put = (value) => tell({ ...current(), [name]: isOne ? value : current()[name].with(c, value) })
    takeTyped(input, figures, field, put, now)
    return {
      input,
      show(enabled) {
        input.disabled = !enabled
        if (document.activeElement !== input) input.value = shownNumber(now(), figures)
      },
    }
  })
  const label = make('span', { className: 'name', 'data-tip': tipOf(control, field) }, control.label)
  const root = make(
    'div',
    { className: 'row triple', ...(!isOne && { role: 'group', 'aria-label': control.label }) },
    label,
    inputs.map(({ input }) => input),
  )
  return { root, show: (enabled) => inputs.forEach((one) => one.show(enabled)) }
}

export function mediumWidget(control, field, tell, media) {
  const id = newId()
  let now = field.default
  const current = () => numbersOf(now, media.list)
  const list = make('select', { id }, groupedBySource(media.list), make('option', { value: own }, 'By its numbers'))
  const rows = Object.keys(mediumControls).map((name) =>
    numberRow(name, media.fields.get(name), current, (medium) => tell(medium, null)),
  )
  const initials = colours.map((colour) => make('span', { className: colour }, colour[0].toUpperCase()))
  const numbers = make(
    'details',
    { className: 'numbers' },
    make('summary', {}, 'Its numbers'),
    make('div', { className: 'row triple initials', 'aria-hidden': 'true' }, make('span', {}, 'per mm'), initials),
    rows.map(({ root }) => root),
  )
  const isListed = () => listedMedium(now, media.list)?.name ?? own
  list.addEventListener('change', () => {
    if (list.value !== own) return tell(list.value, null)
    numbers.open = true // it is by its numbers when one of them is another
    list.value = isListed()
  })
  return {
    root: make('div', { className: 'medium' }, row(control, field, [list], id), numbers),
    show(value, enabled) {
      now = value
      list.value = isListed()
      list.disabled = !enabled
      rows.forEach((one) => one.show(enabled))
    },
  }
}

/** mm to a width, with the share of the width that light of each colour reaches in the scene's medium. */
export function sizeWidget(control, field, tell, media) {
  const size = numberWidget(control, field, tell)
  const bars = colours.map((colour) => ({ colour, bar: make('i', { className: colour }), share: make('span') }))
  const figure = make(
    'div',
    { className: 'reach', role: 'img' },
    bars.flatMap(({ colour, bar, share }) => [
      make('span', {}, colour[0].toUpperCase()),
      make('span', { className: 'track' }, bar),
      share,
    ]),
  )
  const ends = make('p', { className: 'ends' }, make('span', {}, 'translucent'), make('span', {}, 'opaque'))
  const words = make('p', { className: 'note' })
  return {
    root: make('div', { className: 'size' }, size.root, ends, words, figure),
    show(value, enabled, scene) {
      size.show(value, enabled)
      const reach = reachOf(numbersOf(scene.material.medium, media.list))
      const shares = reach.map((mm) => mm / value)
      bars.forEach(({ bar, share }, c) => {
        bar.style.width = `${Math.min(100, 100 * shares[c])}%`
        share.textContent = spokenShare(shares[c])
      })
      words.textContent = `${shownNumber(value, figures)} mm wide. Light reaches, of that width:`
      const spoken = shares.map((share, c) => `${colours[c]} ${spokenShare(share)}`).join(', ')
      figure.setAttribute('aria-label', `Light reaches, of the width: ${spoken}`)
    },
  }
}
