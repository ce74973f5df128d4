// A site of another origin than the server's, for pages that embed pictures; and a proxy that counts and delays requests.
import { once } from 'node:events'
import { createServer, request as httpRequest } from 'node:http'

async function listen(server) {
  server.listen(0, '127.0.0.1')
  await once(server, 'listening')
  return `http://127.0.0.1:${server.address().port}`
}

/** pages: by path, the HTML or [content type, body] of each. May be changed while it runs. */
export async function startSite(pages) {
  const server = createServer((request, reply) => {
    const page = pages[new URL(request.url, 'http://x').pathname]
    const [type, body] = Array.isArray(page) ? page : ['text/html; charset=utf-8', page]
    reply.writeHead(page === undefined ? 404 : 200, { 'Content-Type': type })
    reply.end(body)
  })
  return { address: await listen(server), close: () => server.close() }
}

/**
 * Passes every request on to `target`, after `delay_ms`. `sessions` counts by Relit-Session how many renders are under way
 * (from the request's arrival until it is answered or given up), at most and in all.
 */
export async function startProxy(target) {
  const { hostname, port } = new URL(target)
  const proxy = { delay_ms: 0, renders: [], sessions: new Map() }
  const server = createServer(async (request, reply) => {
    const name = request.headers['relit-session']
    const pieces = []
    for await (const piece of request) pieces.push(piece)
    const body = Buffer.concat(pieces)
    const count = proxy.sessions.get(name) ?? { now: 0, most: 0, all: 0 }
    if (name) {
      proxy.sessions.set(name, count)
      if (request.method === 'POST') {
        count.most = Math.max(count.most, ++count.now)
        ++count.all
        reply.on('close', () => --count.now)
        proxy.renders.push(JSON.parse(body))
      }
    }
    await new Promise((done) => setTimeout(done, proxy.delay_ms))
    if (reply.destroyed) return
    const { method, url: path, headers } = request
    const onward = httpRequest({ hostname, port, method, path, headers }, (answer) => {
      reply.writeHead(answer.statusCode, answer.headers)
      answer.pipe(reply)
    })
    onward.on('error', () => reply.destroy())
    reply.on('close', () => onward.destroy())
    onward.end(body)
  })
  proxy.address = await listen(server)
  proxy.close = () => {
    server.closeAllConnections()
    server.close()
  }
  return proxy
}

/** Id of the sample plato.png, which every server has. */
export const plato = 'c19f4389c237ad9b4f5e8e7ab97c7e4770f41eee5cedf994967fa8e5eca91908'
