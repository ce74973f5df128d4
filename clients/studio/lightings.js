// Lights to start from, over whatever look is on: plain scenes of lights, by the names photographers and map makers use.
import { environmentLight } from './scene.js'

const point = (position, intensity, color = '#ffffff') => ({ type: 'point', position, color, intensity })
const sun = (azimuth, elevation, intensity, color = '#ffffff') => ({
  type: 'directional',
  azimuth,
  elevation,
  color,
  intensity,
})

const lightings = [
  { name: 'Left', lights: [point([0.15, 0.95, 0.6], 1.1)] },
  { name: 'Right', lights: [point([0.85, 0.95, 0.6], 1.1)] },
  { name: 'Front', lights: [point([0.5, 0.6, 1.4], 1.05)] },
  { name: 'Raking', lights: [sun(285, 14, 1.8)] },
  { name: 'Below', lights: [point([0.5, -0.1, 0.35], 1.3)] },
  { name: 'Two sides', lights: [point([-0.05, 0.6, 0.35], 1.1, '#ffc890'), point([1.05, 0.6, 0.35], 1, '#90b8ff')] },
  { name: 'Evening', lights: [sun(300, 18, 2, '#ffd7a8'), sun(120, 55, 0.3, '#b4cbff')] },
  { name: 'Behind', panel: true, lights: [point([0.5, 0.5, -0.35], 1.8, '#ffdcad'), point([0.15, 0.95, 0.45], 0.6)] },
]

/** Names of the lightings; the last one takes an environment. @param environment  id of an image, or nothing */
export const lightingNames = (environment) => [...lightings.map(({ name }) => name), ...(environment ? ['Sky'] : [])]

/** Whether the server takes the lights with the scene's material: samples are counted up to lights at a finite distance. */
export const isPossible = ({ material, lights }) =>
  material.illumination !== 'count' || lights.every(({ type }) => type === 'point')

/** The scene under a lighting; what is lit from behind gets a back. */
export function underLighting(scene, name, environment) {
  if (name === 'Sky') return { ...scene, lights: [environmentLight(environment)] }
  const { lights, panel } = lightings.find((one) => one.name === name)
  return { ...scene, lights, base: panel && scene.base === 'none' ? 'auto' : scene.base }
}
