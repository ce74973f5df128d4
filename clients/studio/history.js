// Undo and redo: whole states, newest last. What one gesture changes, from the first touch until the hand lets go, is
// one step. Plain data, no page.

const longest = 200 // steps that are kept

export const startHistory = (state) => ({ past: [], present: state, future: [], gesture: null })

/**
 * A step forward.
 * @param gesture  a name: consecutive changes of one gesture are one step; null: a step of its own
 */
export function changed(history, state, gesture = null) {
  if (gesture != null && gesture === history.gesture) return { ...history, present: state, future: [] }
  return { past: [...history.past, history.present].slice(-longest), present: state, future: [], gesture }
}

/** The gesture is over: the next change is a step of its own. */
export const settled = (history) => (history.gesture == null ? history : { ...history, gesture: null })

export const canUndo = ({ past }) => past.length > 0
export const canRedo = ({ future }) => future.length > 0

export function undone({ past, present, future }) {
  if (!past.length) return { past, present, future, gesture: null }
  return { past: past.slice(0, -1), present: past.at(-1), future: [present, ...future], gesture: null }
}

export function redone({ past, present, future }) {
  if (!future.length) return { past, present, future, gesture: null }
  return { past: [...past, present], present: future[0], future: future.slice(1), gesture: null }
}
