// Long work of relit.js's clients: uploads that tell how far they are, and batches. Explained in relit-jobs.d.ts. MIT licence.
import { RelitError } from './relit.js'

const pause = (failures, error) =>
  new Promise((done) => {
    setTimeout(done, Math.max(Math.min(250 * 2 ** failures, 8000), (error?.retryAfter ?? 0) * 1000))
  })

/** As client.upload(). fetch() cannot tell how much is sent, so this is the older way. */
export function upload(client, image, { signal, progress } = {}) {
  return new Promise((done, fail) => {
    signal?.throwIfAborted()
    const request = new XMLHttpRequest()
    request.open('POST', client.server + '/v1/images')
    if (client.key) request.setRequestHeader('Authorization', 'Bearer ' + client.key)
    request.responseType = 'json'
    request.upload.onprogress = ({ loaded, total }) => progress?.(loaded, total)
    request.onload = () => {
      const { status, response } = request
      const after = Number(request.getResponseHeader('Retry-After')) || 0
      if (status < 300) done(response)
      else fail(new RelitError(response?.detail ?? `The server answers ${status}.`, status, response, after))
    }
    request.onerror = () => fail(new RelitError('The server does not answer.'))
    request.onabort = () => fail(signal.reason)
    signal?.addEventListener('abort', () => request.abort())
    request.send(new Blob([image]))
  })
}

const newKey = () => Array.from(crypto.getRandomValues(new Uint8Array(16)), (b) => b.toString(16).padStart(2, '0')).join('')

export async function submit(client, batch, { signal, key = newKey() } = {}) {
  const init = {
    signal,
    method: 'POST',
    headers: { 'Content-Type': 'application/json', 'Idempotency-Key': key },
    body: JSON.stringify(batch),
  }
  for (let failures = 0; ; ++failures)
    try {
      return new Batch(client, (await client.get('/v1/batches', init)).id)
    } catch (error) {
      // 409: the server is at work on this very key, which it was sent before.
      if (failures === 6 || !(error.temporary || error.status === 409)) throw error
      await pause(failures, error)
    }
}

export class Batch {
  constructor(client, id) {
    Object.assign(this, { client, id })
  }
  status(options) {
    return this.client.get(this.#path(), options)
  }
  async frame(number, options) {
    return (await this.client.fetch(this.#path(`/frames/${number}`), options)).blob()
  }
  archive(format = 'tar') {
    return `${this.client.server}${this.#path()}/archive?format=${format}`
  }
  retry(options) {
    return this.client.get(this.#path('/retry'), { ...options, method: 'POST' })
  }
  async delete(options) {
    await this.client.fetch(this.#path(), { ...options, method: 'DELETE' })
  }

  async *events({ signal, after } = {}) {
    for (let failures = 0; ; ++failures) {
      let trouble = null
      try {
        for await (const event of this.#stream(signal, after)) {
          failures = 0
          after = event.id ?? after
          yield event
          if (event.event === 'end') return
        }
      } catch (error) {
        if (signal?.aborted || error.temporary === false) throw error
        trouble = error
      }
      await pause(failures, trouble)
      signal?.throwIfAborted()
    }
  }

  // The events of one connection. Of a batch that has nothing more to tell: none, and no end to it (204).
  async *#stream(signal, after) {
    const headers = after ? { 'Last-Event-ID': after } : {}
    const reply = await this.client.fetch(this.#path('/events'), { signal, headers })
    if (reply.status === 204) return yield { event: 'end', ...(await this.status({ signal })) }
    const reader = reply.body.pipeThrough(new TextDecoderStream()).getReader()
    try {
      let text = ''
      for (;;) {
        const { value, done } = await reader.read()
        if (done) return
        const blocks = (text + value).split('\n\n')
        text = blocks.pop()
        for (const block of blocks) {
          const { id, event, data } = Object.fromEntries(block.split('\n').map((line) => line.split(/: (.*)/)))
          if (data) yield { ...JSON.parse(data), id, event }
        }
      }
    } finally {
      reader.cancel().catch(() => {})
    }
  }

  #path(rest = '') {
    return `/v1/batches/${encodeURIComponent(this.id)}${rest}`
  }
}
