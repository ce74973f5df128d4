// The controls' elements: a slider with its number, two thumbs, a colour, words to choose from. Each is {root, show}:
// show(value, enabled, scene) puts a value into it, and `tell(value, gesture)` is called when a hand does; the gesture is a name
// while the hand holds on, so that a drag is one step of undo.
import { fromSlider, shownNumber, toSlider } from './controls.js'
import { allowed, spokenRange } from './fields.js'
import { hexColour } from './scene.js'

/** An element of a name, properties (those with a dash and `aria`, `role`, `data` ones as attributes) and children. */
export function make(name, properties = {}, ...children) {
  const element = document.createElement(name)
  for (const [key, value] of Object.entries(properties)) {
    if (value == null || value === false) continue
    if (key.includes('-') || key === 'role' || key === 'for') element.setAttribute(key, value)
    else element[key] = value
  }
  element.append(...children.flat().filter((child) => child != null))
  return element
}

let names = 0
export const newId = () => `control-${++names}`

/** What a control is said to do: to the picture first, then exactly. */
export const tipOf = (control, field) => {
  const range = spokenRange(field)
  return [control.tip, field.sentence, range && range[0].toUpperCase() + range.slice(1) + '.']
    .filter(Boolean)
    .join('\n')
}

export function row(control, field, parts, inputId) {
  const tip = tipOf(control, field)
  const label = make('label', { for: inputId, className: 'name', 'data-tip': tip }, control.label)
  return make('div', { className: `row ${control.kind}` }, label, parts)
}

export const numberInput = (control, field, label) =>
  make('input', {
    type: 'number',
    className: 'figure',
    inputMode: 'decimal',
    step: field.integer ? 1 : 'any',
    autocomplete: 'off',
    ...(field.low > -1e6 && { min: field.low }),
    ...(field.high < 1e6 && { max: field.high }),
    'aria-label': label,
  })

function fill(slider) {
  const share = (slider.value - slider.min) / (slider.max - slider.min)
  slider.style.setProperty('--fill', `${(share * 100).toFixed(2)}%`)
}

function sliderInput(control) {
  return make('input', {
    type: 'range',
    min: toSlider(control.low, control),
    max: toSlider(control.high, control),
    step: control.step,
    autocomplete: 'off',
  })
}

// A number typed is taken when it is one that the server takes; anything else leaves what was.
export function takeTyped(input, control, field, tell, current) {
  input.addEventListener('change', () => {
    const value = allowed(input.valueAsNumber, field)
    if (value != null) tell(value, null)
    input.value = shownNumber(current(), control)
  })
}

export function numberWidget(control, field, tell) {
  const id = newId()
  let now = control.low
  const figure = numberInput(control, field, control.label)
  takeTyped(figure, control, field, tell, () => now)
  if (control.plain) {
    figure.id = id
    return { root: row(control, field, [figure], id), show: showFigure }
  }
  const slider = Object.assign(sliderInput(control), { id })
  slider.setAttribute('aria-description', control.tip)
  slider.addEventListener('input', () => tell(allowed(fromSlider(Number(slider.value), control), field), id))
  slider.addEventListener('change', () => tell(null, id))
  function showFigure(value, enabled) {
    now = value
    figure.disabled = !enabled
    if (document.activeElement !== figure) figure.value = shownNumber(value, control)
  }
  return {
    root: row(control, field, [slider, figure], id),
    show(value, enabled) {
      showFigure(value, enabled)
      slider.disabled = !enabled
      slider.value = toSlider(value, control)
      slider.setAttribute('aria-valuetext', shownNumber(value, control))
      fill(slider)
    },
  }
}

const gap = 0.01 // the server wants the first below the second

function falloffWidget(control, field, tell) {
  const ends = ['begins', 'is full'].map((end) => {
    const label = `${control.label} ${end}`
    const slider = sliderInput(control)
    slider.setAttribute('aria-label', label)
    return { slider, figure: numberInput(control, field, label) }
  })
  let now = [0, 1]
  const moved = (which, value) => {
    const next = [...now]
    next[which] = which
      ? Math.max(value, Number((now[0] + gap).toFixed(4)))
      : Math.min(value, Number((now[1] - gap).toFixed(4)))
    return next[0] >= -1 && next[1] <= 1 ? next : now
  }
  const gesture = newId()
  ends.forEach(({ slider, figure }, which) => {
    slider.addEventListener('input', () => tell(moved(which, Number(slider.value)), gesture))
    slider.addEventListener('change', () => tell(null, gesture))
    takeTyped(
      figure,
      control,
      field,
      (value) => tell(moved(which, value), null),
      () => now[which],
    )
  })
  const track = make(
    'span',
    { className: 'thumbs' },
    make('span', { className: 'span' }),
    ends.map(({ slider }) => slider),
  )
  const label = make('span', { className: 'name', 'data-tip': tipOf(control, field), tabIndex: -1 }, control.label)
  return {
    root: make(
      'div',
      { className: 'row falloff', role: 'group', 'aria-label': control.label },
      label,
      ends[0].figure,
      track,
      ends[1].figure,
    ),
    show(value, enabled) {
      now = value
      ends.forEach(({ slider, figure }, which) => {
        slider.disabled = figure.disabled = !enabled
        slider.value = value[which]
        if (document.activeElement !== figure) figure.value = shownNumber(value[which], control)
      })
      track.style.setProperty('--from', `${(value[0] + 1) * 50}%`)
      track.style.setProperty('--to', `${(value[1] + 1) * 50}%`)
    },
  }
}

function colourWidget(control, field, tell) {
  const id = newId()
  const input = make('input', { type: 'color', id })
  const code = make('input', {
    type: 'text',
    className: 'figure code',
    'aria-label': `${control.label} as #rrggbb`,
    maxLength: 7,
    spellcheck: false,
    autocomplete: 'off',
  })
  input.addEventListener('input', () => tell(input.value, id))
  input.addEventListener('change', () => tell(null, id))
  code.addEventListener('change', () => {
    const text = code.value.trim().replace(/^#?/, '#').toLowerCase()
    if (/^#[\da-f]{6}$/.test(text)) tell(text, null)
    else code.value = input.value
  })
  return {
    root: row(control, field, [input, code], id),
    show(value, enabled) {
      input.disabled = code.disabled = !enabled
      input.value = hexColour(value)
      if (document.activeElement !== code) code.value = input.value
    },
  }
}

/** Words of which one is chosen: a group of radio buttons. @param options  [[value, name]] */
export function segments(label, options, tell) {
  const group = newId()
  const inputs = options.map(([, name], i) => make('input', { type: 'radio', name: group, id: `${group}-${i}` }))
  inputs.forEach((input, i) => input.addEventListener('change', () => tell(options[i][0])))
  const root = make(
    'span',
    { className: 'segments', role: 'radiogroup', 'aria-label': label },
    inputs.map((input, i) => [input, make('label', { for: input.id }, options[i][1])]).flat(),
  )
  return {
    root,
    show(value, enabled = true, allows = () => true) {
      options.forEach(([own], i) => {
        inputs[i].checked = own === value
        inputs[i].disabled = !enabled || !allows(own)
      })
    },
  }
}

const optionsOf = (control, field) => field.choices.map((word) => [word, control.names[word] ?? word])

function choiceWidget(control, field, tell) {
  const chooser = segments(control.label, optionsOf(control, field), (value) => tell(value, null))
  const label = make('span', { className: 'name', 'data-tip': tipOf(control, field) }, control.label)
  return {
    root: make('div', { className: 'row choice' }, label, chooser.root),
    show: (value, enabled, scene) => chooser.show(value, enabled, (word) => control.allows?.(word, scene) ?? true),
  }
}

function pickWidget(control, field, tell) {
  const id = newId()
  const list = make(
    'select',
    { id },
    optionsOf(control, field).map(([value, name]) => make('option', { value }, name)),
  )
  list.addEventListener('change', () => tell(list.value, null))
  return {
    root: row(control, field, [list], id),
    show(value, enabled) {
      list.value = value
      list.disabled = !enabled
    },
  }
}

function checkWidget(control, field, tell) {
  const id = newId()
  const input = make('input', { type: 'checkbox', id, 'aria-description': control.tip })
  const [on, off] = field.start ? [field.start, null] : [true, false]
  input.addEventListener('change', () => tell(input.checked ? on : off, null))
  const label = make('label', { for: id, 'data-tip': tipOf(control, field) }, control.label)
  return {
    root: make('div', { className: 'row check' }, input, label),
    show(value, enabled) {
      input.checked = value !== off
      input.disabled = !enabled
    },
  }
}

// A control beside words that stand for themselves: "auto", or none.
function wordedWidget(control, field, tell) {
  const { words, ...bare } = control
  const own = plainWidget(bare, field, tell)
  let last = control.start
  const isWord = (value) => words.some(([word]) => word === value)
  const chooser = segments(control.label, [...words, [undefined, 'Set']], (value) =>
    tell(value === undefined ? last : value, null),
  )
  const label = own.root.querySelector('.name')
  const head = make('div', { className: 'row choice' }, label.cloneNode(true), chooser.root)
  label.classList.add('unseen')
  return {
    root: make('div', { className: 'worded' }, head, own.root),
    show(value, enabled) {
      const word = isWord(value)
      if (!word) last = value
      chooser.show(word ? value : undefined, enabled)
      own.root.hidden = word
      if (!word) own.show(value, enabled)
    },
  }
}

const kinds = {
  number: numberWidget,
  falloff: falloffWidget,
  colour: colourWidget,
  choice: choiceWidget,
  pick: pickWidget,
  check: checkWidget,
}
const plainWidget = (control, field, tell) => kinds[control.kind](control, field, tell)

/** The element of a row of controls.js. */
export const widgetOf = (control, field, tell) => (control.words ? wordedWidget : plainWidget)(control, field, tell)
