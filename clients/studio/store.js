// What the studio shows and how it came there: the scene with its history, and what is not part of the scene: which light
// is in hand, which shines alone, what is zoomed in on. Everything else listens.
import { canRedo, canUndo, changed, redone, settled, startHistory, undone } from './history.js'
import { handledIndex } from '../relit.js'
import { same } from './scene.js'
import { wholeView } from './view.js'

export function createStore() {
  const listeners = new Set()
  let history = null
  const maps = new Map() // what is known of height maps, by id: {id, width, height, title}
  const ui = { active: 0, solo: null, view: wholeView, probe: null, section: false, compare: null }

  const tell = (what) => listeners.forEach((listener) => listener(what))
  const hold = (before) => {
    if (before !== store.map) Object.assign(ui, { view: wholeView, probe: null, compare: null })
    const count = store.scene.lights.length
    if (ui.active >= count) ui.active = handledIndex(store.scene.lights)
    if (ui.solo != null && ui.solo >= count) ui.solo = null
  }
  const go = (next) => {
    if (!history || next.present === history.present) return
    const before = store.map
    history = next
    ui.solo = null
    hold(before)
    tell('scene')
  }
  const store = {
    ui,
    get scene() {
      return history?.present ?? null
    },
    get map() {
      return maps.get(history?.present.height.image) ?? null
    },
    get canUndo() {
      return !!history && canUndo(history)
    },
    get canRedo() {
      return !!history && canRedo(history)
    },
    /** Calls listener('scene' | 'hand' | 'ui' | 'rest') after every change; 'hand': the picture shows it already. */
    listen: (listener) => listeners.add(listener),
    /** Has to be told of a height map before a scene of it is shown. @param info  {id, width, height, title} */
    know: (info) => maps.set(info.id, { ...maps.get(info.id), ...info }),
    knows: (id) => maps.has(id),
    mapOf: (id) => maps.get(id),
    /** A scene that is not a step from the one before: its lights are others. */
    open(scene) {
      const before = store.map
      history = history ? changed(history, scene) : startHistory(scene)
      Object.assign(ui, { solo: null, active: handledIndex(scene.lights) })
      hold(before)
      tell('scene')
    },
    /** @param gesture  see history.js @param by  'scene', or 'hand' where the picture shows it already */
    change(scene, gesture = null, by = 'scene') {
      if (!history || same(scene, history.present)) return
      const before = store.map
      history = changed(history, scene, gesture)
      hold(before)
      tell(by)
    },
    settle() {
      if (history) history = settled(history)
      tell('rest')
    },
    undo: () => history && go(undone(history)),
    redo: () => history && go(redone(history)),
    set(part) {
      Object.assign(ui, part)
      tell('ui')
    },
  }
  return store
}
