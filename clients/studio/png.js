// Reads the numbers of a PNG with all their bits, where a canvas would keep eight of sixteen: RFC 2083, not interlaced.

const channelsOf = { 0: 1, 2: 3, 4: 2, 6: 4 } // by colour type; palettes are not read

/**
 * @param bytes  ArrayBuffer of a file with 8 or 16 bits a number
 * @return       {width, height, channels, numbers: Float32Array, 0 to 1, row by row from the top}
 */
export async function decodePng(bytes) {
  const view = new DataView(bytes)
  if (bytes.byteLength < 45 || view.getUint32(0) !== 0x89504e47) throw new Error('This is no PNG.')
  const [width, height] = [view.getUint32(16), view.getUint32(20)]
  const bits = view.getUint8(24)
  const channels = channelsOf[view.getUint8(25)]
  if (!channels || bits < 8 || view.getUint8(28)) throw new Error('This kind of PNG is not read.')
  const packed = []
  for (let at = 8; at + 12 <= bytes.byteLength; at += 12 + view.getUint32(at))
    if (view.getUint32(at + 4) === 0x49444154) packed.push(bytes.slice(at + 8, at + 8 + view.getUint32(at))) // IDAT
  const inflated = new Response(new Blob(packed).stream().pipeThrough(new DecompressionStream('deflate')))
  const rows = new Uint8Array(await inflated.arrayBuffer())
  const step = (channels * bits) / 8
  if (rows.length < height * (width * step + 1)) throw new Error('The PNG ends too early.')
  unfilter(rows, width * step, height, step)
  return { width, height, channels, numbers: numbersOf(rows, width * channels, height, bits) }
}

function paeth(left, up, corner) {
  const [a, b, c] = [Math.abs(up - corner), Math.abs(left - corner), Math.abs(left + up - 2 * corner)]
  return a <= b && a <= c ? left : b <= c ? up : corner
}

// In place; each row is preceded by the byte that tells its filter.
function unfilter(rows, length, height, step) {
  for (let row = 0, at = 1; row < height; ++row, at += length + 1) {
    const filter = rows[at - 1]
    const above = at - length - 1
    if (!filter) continue
    for (let i = 0; i < length; ++i) {
      const left = i < step ? 0 : rows[at + i - step]
      const up = row ? rows[above + i] : 0
      if (filter === 1) rows[at + i] += left
      else if (filter === 2) rows[at + i] += up
      else if (filter === 3) rows[at + i] += (left + up) >> 1
      else rows[at + i] += paeth(left, up, row && i >= step ? rows[above + i - step] : 0)
    }
  }
}

function numbersOf(rows, count, height, bits) {
  const numbers = new Float32Array(count * height)
  const wide = bits === 16
  for (let row = 0; row < height; ++row) {
    const at = row * (count * (wide ? 2 : 1) + 1) + 1
    for (let i = 0; i < count; ++i)
      numbers[row * count + i] = wide ? (rows[at + 2 * i] * 256 + rows[at + 2 * i + 1]) / 65535 : rows[at + i] / 255
  }
  return numbers
}
