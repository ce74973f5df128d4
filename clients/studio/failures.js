// What went wrong and what to do about it, in a sentence or two. Plain functions, no page.

const advice = {
  unauthorized: 'Load the page again to give one.',
  forbidden: 'Load the page again to give another one.',
  'not-found': 'The server may have made room for others: open the file again.',
  'body-too-large': 'Make it smaller and open it again.',
  'image-too-large': 'Make it smaller and open it again.',
  'image-not-supported': 'Export it as one of these and open it again.',
  'image-broken': 'Save it once more and open it again.',
  'storage-full': 'Whoever runs the server can give it more room with --max-storage.',
  'timed-out': 'A smaller picture or fewer lights take less time.',
}

/**
 * @param error  a RelitError, or any other
 * @param again  milliseconds until it is tried again by itself; null: it is not
 */
export function spokenFailure(error, again = null) {
  const wait = again == null ? '' : again < 1500 ? 'Trying again.' : `Trying again in ${Math.round(again / 1000)} s.`
  if (error.status === 0) return `The server does not answer. Is it running? ${wait}`.trim()
  const detail = error.problem?.detail ?? error.message
  const next = wait || advice[error.code] || (error.status === 422 ? 'Undo brings back what worked.' : '')
  return `${detail} ${next}`.trim()
}
