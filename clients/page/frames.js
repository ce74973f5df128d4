// The stream of pictures while a light is dragged. At most one request is under way and one scene waits; a newer scene
// takes the waiting one's place, so the picture is never more than one render behind the hand. When the hand rests, the
// final picture is asked for. Knows no page: fetch, clock and what to do with pictures are given.

/** Why a picture did not come, in a sentence for people. `again_ms`: when asking again makes sense. */
export class Refusal extends Error {
  constructor(sentence, { status = 0, again_ms = null } = {}) {
    super(sentence)
    this.status = status
    this.again_ms = again_ms
  }
}

/** fetch() whose failures are Refusals, with the sentence of the problem document where there is one. */
export async function request(fetch, path, options) {
  let reply
  try {
    reply = await fetch(path, options)
  } catch (error) {
    if (error.name === 'AbortError') throw error
    throw new Refusal('The server does not answer.', { again_ms: 1000 })
  }
  if (reply.ok) return reply
  const problem = await reply.json().catch(() => ({}))
  const wait_s = Number(reply.headers.get('Retry-After'))
  throw new Refusal(problem.detail ?? `The server answered ${reply.status}.`, {
    status: reply.status,
    again_ms: wait_s > 0 ? wait_s * 1000 : null,
  })
}

/**
 * @param render  async (job, signal) -> picture; throws Refusal
 * @param show    (picture, job): called in the order of asking, never for another subject than the newest job's
 * @param fail    (refusal), or (null) when a picture has come again
 * @param rest_ms how long the hand rests before the final picture is fetched
 * @return        ask(preview, final): jobs, plain objects that this module reads `subject` of
 */
export function frameStream({ render, show, fail, rest_ms = 150 }) {
  let waiting = null
  let running = null
  let newest = null
  let rest = null
  let retry = null

  async function run(job) {
    running = { job, cancel: new AbortController() }
    const { signal } = running.cancel
    try {
      const picture = await render(job, signal)
      fail(null)
      if (job.subject === newest.subject && !signal.aborted) show(picture, job)
    } catch (refusal) {
      if (!signal.aborted && refusal.status !== 409) refused(refusal, job) // 409: a newer one took its place
    }
    running = null
    next()
  }

  function refused(refusal, job) {
    fail(refusal)
    if (waiting || refusal.again_ms == null) return
    retry = setTimeout(() => {
      waiting ??= job
      next()
    }, refusal.again_ms)
  }

  function next() {
    if (running || !waiting) return
    clearTimeout(retry)
    const job = waiting
    waiting = null
    run(job)
  }

  return function ask(preview, final) {
    waiting = newest = preview
    if (running && (running.job.final || running.job.subject !== preview.subject)) running.cancel.abort()
    clearTimeout(rest)
    rest = setTimeout(() => {
      waiting = newest = { ...final, final: true }
      next()
    }, rest_ms)
    next()
  }
}
