// The stream of pictures (clients/page/frames.js) with renders that the test finishes by hand.
import assert from 'node:assert/strict'
import test from 'node:test'
import { frameStream, Refusal, request } from '../../clients/page/frames.js'

const settle = () => new Promise((done) => setImmediate(done))

function stream(rest_ms = 500 /* longer than any test here */) {
  const renders = [] // {job, signal, finish, refuse}
  const shown = []
  const failures = []
  const render = (job, signal) => new Promise((finish, refuse) => {
    renders.push({ job, signal, finish: () => finish(job.name), refuse })
    signal.addEventListener('abort', () => refuse(new DOMException('left', 'AbortError')))
  })
  const ask = frameStream({ render, show: (picture) => shown.push(picture), fail: (e) => failures.push(e?.message ?? null), rest_ms })
  const frame = (name, subject = 's') => ask({ name, subject }, { name: `${name} final`, subject })
  return { frame, renders, shown, failures, names: () => renders.map(({ job }) => job.name) }
}

test('one request is under way, and the newest scene waits', async () => {
  const { frame, renders, shown, names } = stream()
  for (const name of ['a', 'b', 'c', 'd']) frame(name)
  assert.deepEqual(names(), ['a'])
  renders[0].finish()
  await settle()
  assert.deepEqual(names(), ['a', 'd'])
  renders[1].finish()
  await settle()
  assert.deepEqual(shown, ['a', 'd'])
  assert.equal(renders.length, 2)
})

test('when the hand rests the final picture comes, and not before', async () => {
  const { frame, renders, shown } = stream(30)
  frame('a')
  renders[0].finish()
  await settle()
  assert.deepEqual(shown, ['a'])
  await new Promise((done) => setTimeout(done, 60))
  renders[1].finish()
  await settle()
  assert.deepEqual(shown, ['a', 'a final'])
})

test('a hand that moves again does not wait for the final picture', async () => {
  const { frame, renders, shown, names } = stream(10)
  frame('a')
  renders[0].finish()
  await new Promise((done) => setTimeout(done, 40))
  assert.deepEqual(names(), ['a', 'a final'])
  frame('b')
  assert.ok(renders[1].signal.aborted)
  await settle()
  assert.equal(names()[2], 'b')
  assert.deepEqual(shown, ['a'])
})

test('no picture of another relief is shown', async () => {
  const { frame, renders, shown, names, failures } = stream()
  frame('old', 'plato')
  frame('new', 'fish')
  await settle()
  assert.ok(renders[0].signal.aborted)
  assert.deepEqual(names(), ['old', 'new'])
  renders[1].finish()
  await settle()
  assert.deepEqual(shown, ['new'])
  assert.deepEqual(failures, [null])
})

test('a refusal is told once and not asked again', async () => {
  const { frame, renders, failures } = stream()
  frame('a')
  renders[0].refuse(new Refusal('No.', { status: 422 }))
  await settle()
  await settle()
  assert.deepEqual(failures, ['No.'])
  assert.equal(renders.length, 1)
})

test('a frame that a newer one superseded is no failure', async () => {
  const { frame, renders, failures } = stream()
  frame('a')
  renders[0].refuse(new Refusal('A newer request.', { status: 409 }))
  await settle()
  assert.deepEqual(failures, [])
})

test('after a failure that may pass it asks again until it is answered', async () => {
  const { frame, renders, failures, shown } = stream()
  frame('a')
  for (let i = 0; i < 3; ++i) {
    renders[i].refuse(new Refusal('Gone.', { again_ms: 5 }))
    await new Promise((done) => setTimeout(done, 25))
    assert.equal(renders.length, i + 2)
  }
  renders[3].finish()
  await settle()
  assert.deepEqual(failures, ['Gone.', 'Gone.', 'Gone.', null])
  assert.deepEqual(shown, ['a'])
})

test('a failed request is the sentence of its problem document', async () => {
  const answers = (status, body, headers) => async () => new Response(body, { status, headers })
  const refusal = async (fetch) => request(fetch, '/', {}).then(() => assert.fail(), (error) => error)

  const problem = await refusal(answers(422, '{"detail":"Too bright."}'))
  assert.deepEqual([problem.message, problem.status, problem.again_ms], ['Too bright.', 422, null])
  const full = await refusal(answers(503, '{"detail":"Full."}', { 'Retry-After': '2' }))
  assert.equal(full.again_ms, 2000)
  const strange = await refusal(answers(502, '<html>'))
  assert.equal(strange.message, 'The server answered 502.')
  const silent = await refusal(async () => { throw new TypeError('Failed to fetch') })
  assert.equal(silent.message, 'The server does not answer.')
  assert.ok(silent.again_ms > 0)
  const left = await refusal(async () => { throw new DOMException('left', 'AbortError') })
  assert.equal(left.name, 'AbortError')
})
