#include "core/render/translucent_light.h"

#include <cassert>
#include <numbers>
#include <optional>

#include "core/base/key.h"
#include "core/render/film_light.h"
#include "core/render/surface_light.h"
#include "core/scatter/dipole.h"
#include "core/scatter/fresnel.h"
#include "core/scatter/highlight.h"
#include "core/scatter/normalised_diffusion.h"

namespace relit {
namespace {

bool has_highlight(const Material& m) { return m.highlight.k > 0; }

bool is_carried(const Highlight& highlight) {
    return highlight.transport == HighlightTransport::subsurface;
}

bool knows_directions(const Material& m) { return m.model == Model::directional_dipole; }

TransportAccuracy transport_accuracy(const Output& output) {
    return output.accuracy == Accuracy::preview ? TransportAccuracy::preview
                                                : TransportAccuracy::final;
}

// R of colour c, in scene units. The directional dipole has none but shares its boundary with the
// better one, which stands for it where light comes from behind.
RadialProfile diffusion_profile(const Material& m, int c) {
    const scatter::Coefficients medium = scatter::channel(m.medium, c, m.mm_per_width);
    switch (m.model) {
        case Model::better_dipole:
        case Model::directional_dipole:
            return radial_profile(scatter::BetterDipole(medium));
        case Model::normalised_diffusion:
            return radial_profile(scatter::NormalisedDiffusion(medium));
        default:
            return radial_profile(scatter::StandardDipole(medium));
    }
}

std::optional<FilmLight> film_of(const Material& m) {
    if (!m.film) return std::nullopt;
    return FilmLight(*m.film, m.medium.eta);
}

// H_n = sigma^2 / (2 pi) H: as bright for any sigma where the surface is flat.
RadialProfile normalised(RadialProfile profile) {
    const double scale = 1 / profile.total;
    return {[at = profile.at, scale](double r) { return scale * at(r); },
            [within = profile.within, scale](double a) { return scale * within(a); }, 1};
}

// sigma_t of the highlight's way below the surface: one for all colours, so that highlights have the
// light's (translucency, section 5.2). Per scene unit.
double highlight_extinction(const Material& m) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) sum += m.medium.sigma_a[c] + m.medium.sigma_s[c];
    return sum / 3 * m.mm_per_width;
}

// What enters or shines at the texels times their areas.
Image flux_of(Image light, const TransportSurface& surface, const RenderControl& control) {
    parallel_rows(control.executor, light.height, control.stop, [&](RowRange rows) {
        for (int j = rows.begin; j < rows.end; ++j)
            for (int i = 0; i < light.width; ++i)
                for (int c = 0; c < light.channels; ++c) light.at(i, j, c) *= surface.area.at(i, j);
    });
    return light;
}

// `light` carried below the surface by a profile per colour.
Image carried(const Scene& scene, const Output& output, const PreparedSolid& prepared, Image light,
              const CarryingKernel& kernel, const RenderControl& control) {
    const auto surface = prepared_surface(scene, prepared, control);
    const auto transport =
        prepared_transport(scene, surface, kernel, transport_accuracy(output), control);
    return transport->sum(flux_of(std::move(light), *surface, control), control.executor,
                          control.stop);
}

// The sum of the directional dipole over light that enters, as M_o / pi: S_d is what leaves per solid
// angle, a share of F_dt of it given back by multiply_by_view() (translucency, section 3).
Image carried_by_directions(const Scene& scene, const Output& output, const PreparedSolid& prepared,
                            SurfaceLight& light, const RenderControl& control) {
    const auto surface = prepared_surface(scene, prepared, control);
    const auto sum =
        prepared_directional_sum(scene, prepared, *surface, transport_accuracy(output), control);
    const auto scale =
        float(std::numbers::pi * scatter::diffuse_transmittance(scene.material.medium.eta));
    Image flux = flux_of(std::move(light.entering), *surface, control);
    for (float& f : flux.values) f *= scale;
    return sum->sum(flux, light.inward, control.executor, control.stop);
}

double normal_z(Slopes slopes) {
    return 1 / std::sqrt(1 + slopes.x * slopes.x + slopes.y * slopes.y);
}

// Calls `share_of` with n . v of every texel and multiplies the colour there by it.
template <class Share>
void multiply_by_view(Image& light, const HeightField& field, const PreparedSolid& prepared,
                      const RenderControl& control, const Share& share_of) {
    parallel_rows(control.executor, light.height, control.stop, [&](RowRange rows) {
        for (int j = rows.begin; j < rows.end; ++j)
            for (int i = 0; i < light.width; ++i) {
                const Rgb share = share_of(normal_z(prepared.shading_slopes().at(field, i, j)));
                float* const out = &light.at(i, j);
                out[0] *= float(share.r), out[1] *= float(share.g), out[2] *= float(share.b);
            }
    });
}

// What enters at the back of a panel and comes through: R over a plane at distance D, lit evenly, is
// the integral of R 2 pi r dr from D on.
void add_through(const Scene& scene, const PreparedSolid& prepared, const Image& entering_behind,
                 const RenderControl& control, Image& flux) {
    if (entering_behind.empty()) return;
    const Solid& solid = prepared.solid;
    for (int c = 0; c < 3; ++c) {
        const RadialProfile profile = diffusion_profile(scene.material, c);
        parallel_rows(control.executor, flux.height, control.stop, [&](RowRange rows) {
            for (int j = rows.begin; j < rows.end; ++j)
                for (int i = 0; i < flux.width; ++i) {
                    const double thickness =
                        std::max(0.0, double(solid.z.at(i + 1, j + 1)) - solid.floor_z);
                    flux.at(i, j, c) += entering_behind.at(i, j, c) *
                                        float(profile.total - profile.within(thickness));
                }
        });
    }
}

// L_o: what leaves towards the viewer, all of M_o spread by T(cos_o) (translucency, section 2.1).
Image subsurface(const Scene& scene, const Output& output, const PreparedSolid& prepared,
                 SurfaceLight& light, const std::optional<FilmLight>& film,
                 const RenderControl& control) {
    const Material& m = scene.material;
    Image leaving = knows_directions(m)
                        ? carried_by_directions(scene, output, prepared, light, control)
                        : carried(scene, output, prepared, std::move(light.entering),
                                  {.name = key_of("diffusion", int(m.model), medium_key(m)),
                                   .profile = [&](int c) { return diffusion_profile(m, c); }},
                                  control);
    add_through(scene, prepared, light.entering_behind, control, leaving);
    const double eta = m.medium.eta;
    const double all = scatter::diffuse_transmittance(eta);
    if (film) {
        multiply_by_view(leaving, *scene.field, prepared, control,
                         [&](double cosine) { return (1 / all) * film->leaving(cosine); });
    } else {
        multiply_by_view(leaving, *scene.field, prepared, control, [&](double cosine) {
            const double share = scatter::transmittance(cosine, eta) / all;
            return Rgb{share, share, share};
        });
    }
    return leaving;
}

// k_h H, H in its normalised form, which is the local highlight wherever the surface is flat (5.3).
Image highlight(const Scene& scene, const Output& output, const PreparedSolid& prepared,
                Image shining, const RenderControl& control) {
    const Material& m = scene.material;
    if (is_carried(m.highlight)) {
        const double sigma = highlight_extinction(m);
        shining = carried(
            scene, output, prepared, std::move(shining),
            {.name = key_of("exponential", sigma),
             .profile =
                 [&](int) { return normalised(radial_profile(scatter::HighlightFalloff{sigma})); }},
            control);
    }
    for (float& v : shining.values) v *= float(m.highlight.k);
    return shining;
}

void add(Image& sum, const Image& other, double weight) {
    for (std::size_t n = 0; n < sum.values.size(); ++n)
        sum.values[n] += float(weight) * other.values[n];
}

TranslucentLight beauty_light(const Scene& scene, const Output& output,
                              const PreparedSolid& prepared, const RenderControl& control) {
    const Material& m = scene.material;
    const std::optional<FilmLight> film = film_of(m);
    SurfaceLight light = surface_light(scene, output, prepared,
                                       {.entering = m.bssrdf_weight > 0,
                                        .highlight = has_highlight(m),
                                        .reflected = m.film.has_value(),
                                        .inward = knows_directions(m)},
                                       film ? &*film : nullptr, control);
    const bool carries = m.bssrdf_weight > 0 || (has_highlight(m) && is_carried(m.highlight));
    TranslucentLight result{.is_coarse = carries && output.accuracy == Accuracy::preview,
                            .coarse_directions = light.coarse_directions};
    result.matt = std::move(light.irradiance);
    for (float& v : result.matt.values) v *= float(m.diffuse_weight);
    if (m.bssrdf_weight > 0)
        add(result.matt, subsurface(scene, output, prepared, light, film, control),
            m.bssrdf_weight);
    result.sheen = std::move(light.reflected);
    if (!has_highlight(m)) return result;
    Image shine = highlight(scene, output, prepared, std::move(light.highlight), control);
    if (result.sheen.empty()) result.sheen = std::move(shine);
    else add(result.sheen, shine, 1);
    return result;
}

TranslucentLight layer_light(const Scene& scene, const Output& output,
                             const PreparedSolid& prepared, const RenderControl& control) {
    const bool enters = output.layer == Layer::subsurface;
    const bool shines = output.layer == Layer::highlight;
    const std::optional<FilmLight> film = enters ? film_of(scene.material) : std::nullopt;
    SurfaceLight light = surface_light(scene, output, prepared,
                                       {.entering = enters,
                                        .highlight = shines,
                                        .inward = enters && knows_directions(scene.material)},
                                       film ? &*film : nullptr, control);
    const bool carries = enters || (shines && is_carried(scene.material.highlight));
    TranslucentLight result{.is_coarse = carries && output.accuracy == Accuracy::preview,
                            .coarse_directions = light.coarse_directions};
    if (enters) result.layer = subsurface(scene, output, prepared, light, film, control);
    else if (shines)
        result.layer = highlight(scene, output, prepared, std::move(light.highlight), control);
    else result.layer = std::move(light.irradiance);
    return result;
}

}  // namespace

TranslucentLight translucent_light(const Scene& scene, const Output& output,
                                   const PreparedSolid& prepared, const RenderControl& control) {
    switch (output.layer) {
        case Layer::beauty:
            if (scene.material.is_translucent())
                return beauty_light(scene, output, prepared, control);
            return {};
        case Layer::irradiance:
        case Layer::subsurface:
        case Layer::highlight:
            return layer_light(scene, output, prepared, control);
        default:
            return {};
    }
}

}  // namespace relit
