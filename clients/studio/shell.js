// What is round the picture: theme, tooltips, tabs of small screens, keys, the first hint, and how long pictures took.
import { kept } from './kept.js'

const $ = (id) => document.getElementById(id)

const themes = ['auto', 'light', 'dark']

export function bindTheme() {
  const button = $('theme')
  const show = (theme) => {
    document.documentElement.dataset.theme = theme
    button.setAttribute('aria-label', `Theme: ${theme}`)
    button.dataset.tip = `Theme: ${theme}`
  }
  show(themes.includes(kept.get('relit-theme')) ? kept.get('relit-theme') : 'auto')
  button.addEventListener('click', () => {
    const next = themes[(themes.indexOf(document.documentElement.dataset.theme) + 1) % themes.length]
    kept.set('relit-theme', next)
    show(next)
  })
}

/** One tooltip for everything with data-tip: under the pointer after a moment, or with the keyboard's focus. */
export function bindTips() {
  const tip = $('tip')
  let late = null
  let of = null
  const hide = () => {
    clearTimeout(late)
    tip.hidden = true
    of = null
  }
  const show = (target) => {
    of = target
    tip.textContent = target.dataset.tip
    tip.hidden = false
    const box = target.getBoundingClientRect()
    const [w, h] = [tip.offsetWidth, tip.offsetHeight]
    const below = box.bottom + 6 + h < innerHeight
    tip.style.left = `${Math.min(Math.max(box.left, 8), innerWidth - w - 8)}px`
    tip.style.top = `${below ? box.bottom + 6 : Math.max(8, box.top - h - 6)}px`
  }
  const plan = (target, ms) => {
    if (target === of) return
    hide()
    if (target?.dataset.tip) late = setTimeout(show, ms, target)
  }
  addEventListener(
    'pointerover',
    (event) => event.pointerType !== 'touch' && plan(event.target.closest?.('[data-tip]'), 450),
  )
  addEventListener('focusin', ({ target }) => {
    if (!target.matches(':focus-visible')) return
    plan(target.closest('[data-tip]') ?? target.closest('.row')?.querySelector('[data-tip]'), 700)
  })
  addEventListener('click', ({ target }) => {
    // a finger asks by tapping the name
    const name = target.closest?.('.name[data-tip]')
    if (name && matchMedia('(hover: none)').matches) show(name)
    else hide()
  })
  addEventListener('scroll', hide, { capture: true, passive: true })
  addEventListener('keydown', hide)
  addEventListener('pointerdown', hide, { capture: true })
}

/** Small screens show one group at a time. */
export function bindTabs() {
  const tabs = [...document.querySelectorAll('#tabs button')]
  const choose = (name) => {
    for (const tab of tabs) tab.setAttribute('aria-selected', String(tab.dataset.tab === name))
    for (const tab of tabs) tab.tabIndex = tab.dataset.tab === name ? 0 : -1
    for (const group of document.querySelectorAll('.group')) group.classList.toggle('chosen', group.id === name)
  }
  tabs.forEach((tab, i) => {
    tab.addEventListener('click', () => choose(tab.dataset.tab))
    tab.addEventListener('keydown', ({ key }) => {
      const step = { ArrowLeft: -1, ArrowRight: 1 }[key]
      if (!step) return
      const next = tabs[(i + step + tabs.length) % tabs.length]
      choose(next.dataset.tab)
      next.focus()
    })
  })
  choose('looks')
}

export function bindKeys(store, stage) {
  $('undo').addEventListener('click', store.undo)
  $('redo').addEventListener('click', store.redo)
  const cut = () => store.set({ section: !store.ui.section })
  const compare = () => store.set({ compare: store.ui.compare ? null : { scene: store.scene, at: 0.5 } })
  $('cut-toggle').addEventListener('click', cut)
  $('cut-close').addEventListener('click', cut)
  $('compare').addEventListener('click', compare)
  const keys = {
    c: compare,
    x: cut,
    o: () => $('open').click(),
    '+': () => stage.zoomAt(Math.SQRT2),
    '=': () => stage.zoomAt(Math.SQRT2),
    '-': () => stage.zoomAt(Math.SQRT1_2),
    0: stage.whole,
    w: () => stage.panBy(0, 60),
    a: () => stage.panBy(60, 0),
    s: () => stage.panBy(0, -60),
    d: () => stage.panBy(-60, 0),
  }
  addEventListener('keydown', (event) => {
    if (!store.scene || event.altKey || document.querySelector('dialog[open]')) return
    const typing = event.target.closest(
      'input:not([type="range"], [type="radio"], [type="checkbox"], [type="color"]), textarea, select',
    )
    if (typing) return
    const key = event.key.toLowerCase()
    if (event.ctrlKey || event.metaKey) {
      const redo = key === 'y' || (key === 'z' && event.shiftKey)
      if (!redo && key !== 'z') return
      event.preventDefault()
      return redo ? store.redo() : store.undo()
    }
    if (!keys[key]) return
    event.preventDefault()
    keys[key]()
  })
  bindHint(store)
}

function bindHint(store) {
  const hint = $('hint')
  hint.hidden = !!kept.get('relit-hint')
  const done = () => {
    hint.hidden = true
    kept.set('relit-hint', 'seen')
  }
  $('hint-close').addEventListener('click', done)
  let moves = 0
  store.listen((by) => (by === 'hand' || (by === 'ui' && store.ui.view.zoom > 1)) && ++moves === 12 && done())
}

/** Frames a second while something moves, and where the milliseconds of the newest picture went. */
export function showTimings(picture) {
  let times = []
  let next = 0
  picture.addEventListener('relit-frame', ({ detail }) => {
    const now = performance.now()
    times = [...times.filter((time) => now - time < 1000), now]
    if (!detail.final && now < next) return // figures that change at every frame cannot be read
    next = now + 200
    const { render, encode, network } = detail.timing
    $('rate').textContent = detail.final ? 'final' : `${times.length} fps`
    for (const [id, ms] of Object.entries({ render, encode, network }))
      $(`${id}-ms`).textContent = ms < 9.95 ? ms.toFixed(1) : ms.toFixed(0)
    $('pixels').textContent = `${detail.width} × ${detail.height}`
  })
}
