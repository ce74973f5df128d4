// What the browser keeps for the studio: by name, as text. It may refuse to, and then things last as long as the page.

const keptIn = (storage) => ({
  get(name) {
    try {
      return globalThis[storage].getItem(name)
    } catch {
      return null
    }
  },
  set(name, value) {
    try {
      globalThis[storage].setItem(name, value)
    } catch {
      /* for this visit, then */
    }
  },
})

export const kept = keptIn('localStorage')
/** Until the tab is closed. */
export const keptInTab = keptIn('sessionStorage')
