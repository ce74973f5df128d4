// Servers that ask for a key: the client that brings it, and the dialog in which it is given.
import { Relit } from '../relit.js'
import { keptInTab } from './kept.js'

const $ = (id) => document.getElementById(id)
const isRefusal = ({ status, code }) => status === 401 || code === 'forbidden' // no key, not this one, not good for that

/** A server as Relit has it; where it wants a key, or another one, that is asked for, and every call waits for it. */
export class KeyedClient extends Relit {
  #asking = null
  constructor(server) {
    super(server, { key: keptInTab.get('relit-key') })
  }
  fetch(path, options) {
    return this.withKey(() => super.fetch(path, options))
  }
  /** What `work` returns, which sends the key by itself. @throws its refusal where no key is given */
  async withKey(work) {
    for (;;) {
      const { key } = this
      try {
        return await work()
      } catch (error) {
        if (!isRefusal(error)) throw error
        if (key === this.key) await (this.#asking ??= this.#ask(error).finally(() => (this.#asking = null)))
      }
    }
  }
  async #ask(refusal) {
    this.key = await askedKey(this.key ? refusal.message : 'This server asks for one.', refusal)
    keptInTab.set('relit-key', this.key)
  }
  /** The address of a picture for <img>: itself or, where the server asks for a key, the picture as a blob. Asks for no key. */
  async source(url) {
    if (!this.key) return url
    return URL.createObjectURL(await (await super.fetch(url.slice(this.server.length))).blob())
  }
}

/** The key that is typed in. @param why  a sentence @throws refusal where the dialog is left without */
function askedKey(why, refusal) {
  const dialog = $('key')
  const field = $('key-value')
  $('key-why').textContent = why
  field.value = ''
  dialog.returnValue = ''
  dialog.showModal()
  return new Promise((done, fail) => {
    $('key-form').onsubmit = (event) => {
      event.preventDefault()
      dialog.close(field.value.trim())
    }
    $('key-leave').onclick = () => dialog.close()
    dialog.onclose = () => (dialog.returnValue ? done(dialog.returnValue) : fail(refusal))
  })
}
