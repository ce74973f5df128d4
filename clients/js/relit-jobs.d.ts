// Types of relit-jobs.js: long work of relit.js's clients.
import type { Abortable, ImageInfo, Problem, Relit, Scene } from './index.js'

/** As client.upload(). @param options.progress  told how many bytes are sent, and of how many; in browsers only */
export function upload(
  client: Relit,
  image: Blob | ArrayBuffer | ArrayBufferView,
  options?: Abortable & { progress?: (sent: number, total: number) => void },
): Promise<ImageInfo>

export type BatchRequest = { priority?: number } & (
  | { scene: Scene; frames: (Scene & { name?: string })[] }
  | { scene: Scene; sweep: { path: 'orbit' | 'arc' | 'line' | 'environment'; count: number; [field: string]: unknown } }
  | { scenes: (Scene & { name?: string })[] }
)
/**
 * Submits a batch: the server holds it durably when this returns. What may succeed later is tried again, six times.
 * @param options.key  the same key and batch again is the same batch; default: a new one
 */
export function submit(client: Relit, batch: BatchRequest, options?: Abortable & { key?: string }): Promise<Batch>

export interface BatchStatus {
  id: string
  status: 'queued' | 'running' | 'done'
  total: number
  done: number
  failed: number
  problems: { frame: number; name: string; problem: Problem }[]
  [field: string]: unknown
}
/** `id` is for events({after}). */
export type BatchEvent =
  | { id: string; event: 'frame'; frame: number; name: string; status: 'done'; bytes: number }
  | { id: string; event: 'frame'; frame: number; name: string; status: 'failed'; problem: Problem }
  | { id?: string; event: 'end'; status: 'done' | 'deleted'; total: number; done: number; failed: number }

export class Batch {
  /** A batch that was submitted before. */
  constructor(client: Relit, id: string)
  readonly client: Relit
  readonly id: string
  status(options?: Abortable): Promise<BatchStatus>
  /** Every event once, up to the end, over cut connections and restarts of the server. @param options.after  an event's id */
  events(options?: Abortable & { after?: string }): AsyncGenerator<BatchEvent, void>
  /** A finished picture. */
  frame(number: number, options?: Abortable): Promise<Blob>
  /** Address of all pictures in one file. */
  archive(format?: 'tar' | 'zip'): string
  /** Has the failed frames rendered again. */
  retry(options?: Abortable): Promise<BatchStatus>
  /** Stops it and removes its pictures. */
  delete(options?: Abortable): Promise<void>
}
