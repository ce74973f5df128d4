// Media as the server lists them (GET /v1/media), and how far light reaches in one. Plain arithmetic, no page.
//
// A medium of a scene is the name of a listed one or its numbers, {sigmaA, sigmaS: per mm, of red, green and blue, g, eta}.

/** The numbers of a medium. */
export const numbersOf = (medium, media) =>
  typeof medium === 'string' ? media.find(({ name }) => name === medium).medium : medium

const compared = ({ sigmaA, sigmaS, g, eta }) => JSON.stringify([sigmaA, sigmaS, g, eta])

/** The listed medium that this one is; nothing where its numbers are its own. */
export const listedMedium = (medium, media) =>
  media.find((one) => one.name === medium || compared(one.medium) === compared(numbersOf(medium, media)))

/** mm in which light of each colour falls to 1/e on its way through: 1 / sigma_tr. */
export const reachOf = ({ sigmaA, sigmaS, g }) =>
  sigmaA.map((absorbed, c) => {
    const reduced = absorbed + sigmaS[c] * (1 - g[c])
    return 1 / Math.sqrt(3 * Math.max(absorbed, 1e-8 * reduced) * reduced)
  })

/** A share as "5.9 %"; more than all of it is all. */
export function spokenShare(share) {
  if (share >= 0.995) return 'all'
  const percent = 100 * share
  return `${percent < 0.01 ? '< 0.01' : Number(percent.toPrecision(2))} %`
}
