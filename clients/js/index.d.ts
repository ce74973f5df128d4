// Types of relit.js: a client of Relit servers, and the element <relit-image>.

export type Vec3 = [number, number, number]
/** "#rrggbb", or linear red, green and blue. */
export type Color = string | Vec3
/** A stored image, or bytes as base64. The element takes stored ones as `height`. */
export type ImageSource = { image: string } | { data: string }

export interface PointLight {
  type: 'point'
  /** x and y as fractions of the map, 0, 0 at the bottom left; z in widths of the map, negative behind it. */
  position?: Vec3
  color?: Color
  intensity?: number
}
export interface DirectionalLight {
  type: 'directional'
  /** Degrees clockwise from the top. */
  azimuth?: number
  /** Degrees above the picture; negative from behind. */
  elevation?: number
  /** In place of the angles. */
  direction?: Vec3
  color?: Color
  intensity?: number
}
export interface EnvironmentLight {
  type: 'environment'
  image: ImageSource
  /** Degrees: yaw, pitch. */
  rotation?: [number, number]
  intensity?: number | 'auto'
  weighting?: 'solid-angle' | 'uniform'
  radius?: number | null
}
export type Light = PointLight | DirectionalLight | EnvironmentLight

/** Coefficients per mm of red, green and blue. */
export interface Medium {
  sigmaA: Vec3
  sigmaS: Vec3
  g?: Vec3
  eta?: number
}
/** The models of subsurface scattering take a medium, by a name of `/v1/media` or its numbers, and what follows it. */
export interface Material {
  model?: 'integrated' | 'dipole' | 'better-dipole' | 'directional-dipole' | 'normalised-diffusion'
  baseColor?: Color
  diffuseColor?: Color
  specularColor?: Color
  depth?: number
  offset?: 'normal' | 'view'
  illumination?: 'length' | 'exponential' | 'count'
  attenuation?: number
  steps?: number
  specular?: { k?: number; falloff?: [number, number]; occlude?: boolean }
  scatter?: { k?: number; falloff?: [number, number] }
  medium?: string | Medium
  mmPerWidth?: number
  /** Of 'directional-dipole' alone. */
  dirdipoleEnergy?: 'published' | 'matched'
  bssrdfWeight?: number
  diffuseWeight?: number
  film?: { medium?: string | Medium; thickness?: number; g?: number | null } | null
  highlight?: {
    lobe?: 'cosine' | 'ward' | 'ashikhmin' | 'lafortune'
    transport?: 'local' | 'subsurface'
    k?: number
    nt?: number
    nb?: number
    exponent?: number
  }
}
export interface Output {
  format?: 'png' | 'jpeg' | 'webp' | 'exr'
  layer?:
    | 'beauty'
    | 'illumination'
    | 'thickness'
    | 'normal'
    | 'specular'
    | 'scatter'
    | 'irradiance'
    | 'subsurface'
    | 'highlight'
    | 'height'
    | 'alpha'
  accuracy?: 'final' | 'preview'
  width?: number | null
  height?: number | null
  /** x, y, width, height in texels of the map, row 0 at the top. */
  region?: [number, number, number, number] | null
  bitDepth?: 8 | 16 | 32 | null
  quality?: number
  effort?: 'fast' | 'small'
  exposure?: number
  tone?: 'clip' | 'filmic'
  transfer?: 'srgb' | 'none'
  background?: Color | null
}
/** A scene of the interface, or a part of one: what is missing has the server's default. */
export interface Scene {
  preset?: string
  height?: ImageSource
  alpha?: ImageSource | null
  albedo?: ImageSource | null
  bump?: ImageSource | null
  bumpRelief?: number
  relief?: number
  base?: number | 'none' | 'auto'
  normalScale?: number
  /** One light, or `lights`: never both. */
  light?: Light
  lights?: Light[]
  material?: Material
  output?: Output
}

export interface ImageInfo {
  id: string
  width: number
  height: number
  channels: number
  type: string
  format: string
  bytes: number
  created?: string
}

/** Milliseconds. `network`: of `total`, from asking to the last byte, what is not the server's; of that, `transfer`: from the head on. */
export interface Timing {
  parse: number
  queue: number
  decode: number
  render: number
  encode: number
  network: number
  transfer: number
  total: number
}
export interface Picture {
  blob: Blob
  /** With its quotes, as HTTP has it; null of a preview. */
  etag: string | null
  /** "final", or "preview" and what was coarser. */
  accuracy: string
  timing: Timing
}

/** An RFC 9457 document. */
export interface Problem {
  type: string
  title: string
  status: number
  detail: string
  pointer?: string
}
/** Every failure but an abort, which is an AbortError as of fetch(). The message is a sentence for people. */
export class RelitError extends Error {
  /** HTTP status; 0: no answer. */
  status: number
  /** The end of the problem's type, "not-found"; undefined where there was no answer, or none that is a problem. */
  code?: string
  problem?: Problem
  /** Seconds, as Retry-After says; 0 where it does not. */
  retryAfter?: number
  /** Whether the same request may succeed later: no answer, 429, 502, 503, 507. */
  temporary: boolean
  constructor(message: string, status?: number, problem?: Problem, retryAfter?: number)
}

export interface Abortable {
  signal?: AbortSignal
}

/** One server. */
export class Relit {
  /**
   * @param server       its address, with a path where it is mounted under one; default: where the module came from
   * @param options.key  for a server that asks for one: sent with every request. Visitors of the page can read it.
   */
  constructor(server?: string, options?: { key?: string | null })
  readonly server: string
  /** A new one may be set. */
  key?: string | null
  /** fetch() of a path of the server; what is no success is thrown as a RelitError. */
  fetch(path: string, init?: RequestInit): Promise<Response>
  /** What GET answers, as JSON: get('/v1/presets'). */
  get(path: string, options?: Abortable): Promise<any>
  /** Stores an image: the same bytes always have the same id. With progress: relit-jobs.js. */
  upload(image: Blob | ArrayBuffer | ArrayBufferView, options?: Abortable): Promise<ImageInfo>
  /** A dry run: the scene with every default filled in, and the ETag of its picture (null of a preview). */
  scene(scene: Scene, options?: Abortable): Promise<{ scene: Scene; etag: string | null }>
  /** @param options.session  a token: a newer render of the same session stops the older ones, which fail with 409 */
  render(scene: Scene, options?: Abortable & { session?: string }): Promise<Picture>
  /** The address of the scene's picture, for <img src> and downloads. It holds no key: a server with keys wants it signed. */
  url(scene: Scene): string
}

// Pointer and light: plain arithmetic. Positions are [x, y] in CSS pixels from the picture's top left corner, sizes are
// [width, height] of the picture as it is shown. `crop` is what of the map the picture shows, [left, top, width, height]
// as shares of the map; default: all. Fields that a light lacks have their defaults.

/**
 * Where the handle is. Of a point light: where it is, seen from the front. Of a directional one: on a dome seen from
 * above, whose horizon is the circle of half the picture's shorter side; outside it is behind. Of an environment: its
 * centre, the picture being 360 degrees of yaw wide and 180 of pitch high.
 */
export function handlePosition(light: Light, size: [number, number], crop?: number[]): [number, number]
/** A copy of the light, moved so that its handle is at a position. */
export function lightAt<L extends Light>(light: L, position: [number, number], size: [number, number], crop?: number[]): L
/** [azimuth, elevation] in degrees, whichever way the light says it. */
export function sunAngles(light: DirectionalLight): [number, number]
/** Which light a hand moves unless it is told: the first point, or else the first. */
export function handledIndex(lights: Light[]): number
/** What a screen reader says of it. */
export function spokenLight(light: Light): string
/**
 * How large the next picture of a drag is, as a share of the sides of the best one: the server's work on it and its transfer
 * take two thirds of a displayed frame (60 a second), or half as long as the way there and back.
 */
export function nextScale(scale: number, timing: Timing): number

export interface LightDetail {
  scene: Scene
  light: Light
  index: number
  /** False while it moves; true once when the hand has let go or rests. */
  rest: boolean
}
export interface FrameDetail extends Picture {
  /** What the picture shows: the element's `scene` at the time of asking, the same object. */
  scene: Scene
  /** False of the quick pictures while something moves. */
  final: boolean
  width: number
  height: number
}

/**
 * <relit-image src server key scene preset light sun env alt>
 *
 * src      id of a stored image, or an address: fetched by the browser and uploaded
 * server   default: where the module came from
 * key      for a server that asks for one; visitors of the page can read it
 * scene    JSON of a scene, under the other attributes
 * preset   its name
 * light    "x,y,z"; sun: "azimuth,elevation"; env: "id,yaw,pitch"
 * alt      what the picture shows, for those who do not see it
 *
 * Changing an attribute but alt starts over from the attributes. The picture is as large as the element is laid out (as a
 * block, with the aspect of what is shown), so that CSS sizes it; its pixels are the device's. No padding, please. The element has
 * aria-busy="true" until the final picture is there. Parts to style: `picture` and `handle`, in which --relit-light is the light's
 * colour. ::part(picture) { touch-action: pan-y } lets a finger scroll the page.
 *
 * A drag asks for quick pictures (JPEG; PNG where something is transparent; WebP where the way is slow), the largest that come
 * in time, and for the final one (PNG, all pixels) when the hand has let go or rests for 150 ms. At most one request is under
 * way and one scene waits, whose place a newer one takes; while the server is away it is asked again after 0.25 s, and twice as
 * long each time up to 8 s; an address in `src` that does not answer is given up after six times. Nothing is eased or moves by
 * itself, so that prefers-reduced-motion has nothing to change.
 *
 * Arrow keys move the light by 2 % of the picture's width, with Shift by 10 %; Page Up and Page Down a point light nearer and
 * farther. A pointerdown or keydown whose default was prevented on its way in (capture) is left alone.
 */
export class RelitImage extends HTMLElement {
  /**
   * What is shown, with `lights`; never changed in place: every change makes a new object. Setting it shows another scene:
   * one with a preset or without lights is completed by the server first, any other is rendered as it is, at once, and as
   * a drag where one scene follows the other quickly. Of `output`, the element itself sets what depends on the moment:
   * accuracy, format, quality, effort, bitDepth, width and height; layer, region, exposure, tone, transfer and background count.
   */
  get scene(): Scene | null
  set scene(scene: Scene | null | undefined)
  /** Index of the light that the hand moves. */
  active: number
  /** The server, as a client; another one may be set. There as soon as the element is in a document. */
  client: Relit
  /** The height map, once it is known. */
  readonly map: ImageInfo | undefined
}

export interface RelitEventMap {
  /** The light was moved by the hand or a key. */
  'relit-light': CustomEvent<LightDetail>
  /** A picture is on the screen. */
  'relit-frame': CustomEvent<FrameDetail>
  /** Something failed. `again`: milliseconds until it is tried again by itself, null: never. Nothing else tells it. */
  'relit-error': CustomEvent<{ error: RelitError; again: number | null }>
  /** After an error a picture has come again. */
  'relit-recovery': CustomEvent<0>
}

export interface RelitImage {
  addEventListener<K extends keyof RelitEventMap>(
    type: K,
    listener: (this: RelitImage, event: RelitEventMap[K]) => any,
    options?: boolean | AddEventListenerOptions,
  ): void
  addEventListener(
    type: string,
    listener: EventListenerOrEventListenerObject,
    options?: boolean | AddEventListenerOptions,
  ): void
}

declare global {
  interface HTMLElementTagNameMap {
    'relit-image': RelitImage
  }
}
