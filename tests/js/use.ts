// Uses everything that relit.js and relit-jobs.js declare; compiled by package.test.js, never run. Where the types must refuse
// something, the line above says so, and the compiler complains if they do not.
import { handledIndex, handlePosition, lightAt, nextScale, Relit, RelitError, spokenLight, sunAngles } from 'relit'
import type { FrameDetail, ImageInfo, Light, PointLight, RelitImage, Scene } from 'relit'
import { Batch, submit, upload } from 'relit/jobs'

export async function client(file: File, signal: AbortSignal): Promise<string> {
  const relit = new Relit('https://relit.example', { key: 'a-key-of-scope-render' })
  const info: ImageInfo = await upload(relit, file, { signal, progress: (sent, total) => console.log(sent / total) })
  const scene: Scene = { preset: 'bronze', height: { image: (await relit.upload(file)).id }, light: { type: 'point' } }
  // @ts-expect-error: no such type of light
  const wrong: Scene = { light: { type: 'spot' } }
  // @ts-expect-error: no such field
  const misspelt: Scene = { material: { depht: 1 } }
  try {
    const { blob, etag, accuracy, timing } = await relit.render(scene, { session: 'a', signal })
    const whole = (await relit.scene(scene)).scene
    console.log(blob.size, etag?.length, accuracy, timing.network + timing.render, whole.lights, wrong, misspelt)
  } catch (error) {
    if (error instanceof RelitError) return `${error.status} ${error.code} ${error.problem?.pointer} ${error.retryAfter}`
  }
  const batch: Batch = await submit(relit, { scene, sweep: { path: 'orbit', count: 24 } }, { key: info.id })
  for await (const event of batch.events({ signal }))
    if (event.event === 'frame' && event.status === 'failed') console.log(event.problem.detail)
    else if (event.event === 'end') console.log(event.done)
  return relit.url(scene) + batch.archive('zip') + (await new Batch(relit, batch.id).frame(0)).size
}

export function arithmetic(lights: Light[]): string {
  const light = lights[handledIndex(lights)]
  const lamp: PointLight = lightAt({ type: 'point', position: [0, 0, 1] }, [10, 20], [400, 300], [0, 0, 1, 1])
  const [x, y]: [number, number] = handlePosition(light, [400, 300])
  const scale = nextScale(1, { parse: 0, queue: 0, decode: 0, render: 4, encode: 1, network: 5, transfer: 1, total: 10 })
  return spokenLight(lamp) + x + y + scale + (light.type === 'directional' ? sunAngles(light)[1] : '')
}

export function page(): RelitImage {
  const image = document.createElement('relit-image')
  image.setAttribute('src', 'relief.png')
  image.scene = { height: { image: 'a' }, lights: [{ type: 'directional', azimuth: 300 }] }
  image.active = 0
  image.client = new Relit()
  image.client.key = null
  image.addEventListener('relit-light', ({ detail }) => console.log(detail.light.type, detail.rest))
  image.addEventListener('relit-frame', (event) => {
    const { width, height, final, timing }: FrameDetail = event.detail
    console.log(width / height, final, timing.total, image.map?.width)
  })
  image.addEventListener('relit-error', ({ detail: { error, again } }) => console.log(error.message, again ?? 'never'))
  image.addEventListener('relit-recovery', () => console.log('again'))
  // @ts-expect-error: the map is the server's
  image.map = undefined
  return image
}
