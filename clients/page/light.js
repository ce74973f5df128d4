// Where a light's handle is over the picture, and which light a handle means: plain arithmetic, no page.
//
// Positions are [x, y] in CSS pixels from the picture's top left corner, sizes are [width, height] of the picture as it
// is shown. Lights are those of the interface; none is changed, a changed copy is returned.
//
//   point         the handle is where the light is, seen from the front
//   directional   a dome seen from above: the centre is the viewer's direction, the circle of half the picture's shorter
//                 side the horizon, and what lies outside it comes from behind
//   environment   the handle is the environment's centre: the width is 360 degrees of yaw, the height 180 of pitch

const radians = Math.PI / 180
const clamp = (number, low, high) => Math.min(Math.max(number, low), high)
const rounded = (number, digits) => Number(number.toFixed(digits))

/** The light that the handle moves: the first point light, or else the first of all. */
export function handledIndex(lights) {
  return Math.max(0, lights.findIndex((light) => light.type === 'point'))
}

/** Radius of the dome's horizon in pixels. */
export const horizonRadius = ([width, height]) => Math.min(width, height) / 2

/** [azimuth, elevation] in degrees, whichever way the light says it. */
export function sunAngles(light) {
  if (!light.direction) return [light.azimuth, light.elevation]
  const [x, y, z] = light.direction
  return [(Math.atan2(x, y) / radians + 360) % 360, Math.atan2(z, Math.hypot(x, y)) / radians]
}

/** A turn in degrees, as one in -180 (excluded) to 180. */
export const halfTurn = (degrees) => 180 - ((((180 - degrees) % 360) + 360) % 360)

export function handlePosition(light, size) {
  const [width, height] = size
  if (light.type === 'point') return [light.position[0] * width, (1 - light.position[1]) * height]
  if (light.type === 'directional') {
    const [azimuth, elevation] = sunAngles(light)
    const distance = horizonRadius(size) * (1 - elevation / 90)
    return [
      width / 2 + distance * Math.sin(azimuth * radians),
      height / 2 - distance * Math.cos(azimuth * radians),
    ]
  }
  const [yaw, pitch] = light.rotation
  return [width * (0.5 + halfTurn(yaw) / 360), height * (0.5 + clamp(halfTurn(pitch), -90, 90) / 180)]
}

export function lightAt(light, [x, y], size) {
  const [width, height] = size
  if (light.type === 'point') {
    const across = clamp(x / width, -1000, 1000)
    const up = clamp(1 - y / height, -1000, 1000)
    return { ...light, position: [rounded(across, 4), rounded(up, 4), light.position[2]] }
  }
  if (light.type === 'directional') {
    const right = x - width / 2
    const up = height / 2 - y
    const elevation = Math.max(-90, 90 * (1 - Math.hypot(right, up) / horizonRadius(size)))
    const azimuth = (Math.atan2(right, up) / radians + 360) % 360
    const { direction, ...rest } = light
    return { ...rest, azimuth: rounded(azimuth, 2), elevation: rounded(elevation, 2) }
  }
  const yaw = halfTurn((x / width - 0.5) * 360)
  const pitch = clamp((y / height - 0.5) * 180, -90, 90)
  return { ...light, rotation: [rounded(yaw, 2), rounded(pitch, 2)] }
}

/** A position moved into the picture and `margin` pixels round it; the handle is shown there. */
export const withinReach = ([x, y], [width, height], margin) => [
  clamp(x, -margin, width + margin),
  clamp(y, -margin, height + margin),
]

/** What a screen reader says of the light. */
export function spokenLight(light) {
  if (light.type === 'point') {
    const [x, y, z] = light.position
    const percent = (share) => `${Math.round(share * 100)} %`
    return `${percent(x)} from the left, ${percent(y)} up, ${Math.abs(z).toFixed(2)} ${z < 0 ? 'behind' : 'in front'}`
  }
  if (light.type === 'directional') {
    const [azimuth, elevation] = sunAngles(light)
    return `azimuth ${Math.round(azimuth)}°, elevation ${Math.round(elevation)}°`
  }
  return `turned ${Math.round(light.rotation[0])}°, tilted ${Math.round(light.rotation[1])}°`
}
