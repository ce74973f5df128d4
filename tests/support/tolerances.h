// Every tolerance that a picture is held to, in one table: an improvement tightens its row.
#pragma once

namespace relit::test::tolerance {

// Against the dense march of tests/support/reference.h on real reliefs. d in [0, 1].
inline constexpr double mean_d =
    0.0002;  // asked for: 0.002; the reference's own steps make most of it
inline constexpr double d_of_99_percent = 0.003;  // asked for: 0.02
inline constexpr double beauty_psnr_db = 65;      // asked for: 45; of sRGB-encoded colour

// Packets of rays against the scalar march, of d. Reliefs and terrain have the rows above.
inline constexpr double packet_hills_psnr_db = 75;  // maps of down to 3 texels; asked for: 60
inline constexpr double packet_rough_psnr_db = 90;  // white noise of up to 9 texels; asked for: 38

// Closed forms. d in [0, 1].
inline constexpr double plane_d = 1e-5;  // asked for: 1e-4; heights are floats

// Environments, of sRGB-encoded colour: small maps (at most 512 texels) against the full sum of the
// dense march, large ones against the full sum of core's own march.
inline constexpr double environment_psnr_db = 75;           // asked for: 45
inline constexpr double gathered_environment_psnr_db = 50;  // asked for: 45
inline constexpr double gathered_highlight_psnr_db = 45;    // down to a falloff of [0.99, 1]

// Environments at infinity, of linear colour (1 = white), against the full sum of core's own march.
inline constexpr double sun_and_sky_rms = 0.004;  // asked for: 0.004
inline constexpr double soft_boxes_rms = 0.0025;  // asked for: 0.0025
// Sharper than the functions that d is projected on: an exponential d under a sun, and lamps at the
// poles of a map with uniform weights, which make them bright.
inline constexpr double sharp_sky_rms = 0.0055;

}  // namespace relit::test::tolerance
