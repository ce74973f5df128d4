#include "tests/reference/cases.h"

#include <cmath>
#include <map>
#include <numbers>

#include "core/scatter/backbone.h"
#include "core/scatter/dipole.h"
#include "core/scatter/directional_dipole.h"
#include "core/scatter/fresnel.h"
#include "core/scatter/highlight.h"
#include "core/scatter/lobes.h"
#include "core/scatter/normalised_diffusion.h"
#include "core/scatter/thin_layer.h"
#include "tests/reference/field_sums.h"

namespace relit::test::reference {
namespace {

using namespace scatter;

constexpr double degree = std::numbers::pi / 180;

Json list_of(Vec3 v) { return {v.x, v.y, v.z}; }

// Boundaries.

Json fresnel_case(const Fields& in) {
    return fresnel(in.number("cos_i", 0, 1), in.positive("eta"));
}

Json moments_case(const Fields& in) {
    const double eta = in.positive("eta");
    const Moments fitted = fitted_moments(eta), exact = exact_moments(eta);
    return {{"C1", fitted.c1},
            {"C2", fitted.c2},
            {"Cphi", c_phi(fitted)},
            {"CE", c_e(fitted)},
            {"C1_exact", exact.c1},
            {"C2_exact", exact.c2},
            {"fdr_poly", fitted_diffuse_reflectance(eta)}};
}

Json boundary_case(const Fields& in) {
    const double eta = in.number("eta", 1, 10);
    return {{"A_jensen", standard_boundary(eta)},
            {"A_moments", moment_boundary(eta)},
            {"fdt_ext", diffuse_transmittance(eta)}};
}

Json derived_case(const Fields& in) {
    const Derived d = derived(in.coefficients());
    return {{"sigma_s_prime", d.sigma_s_prime},
            {"sigma_t", d.sigma_t},
            {"sigma_t_prime", d.sigma_t_prime},
            {"alpha_prime", d.alpha_prime},
            {"W", d.albedo},
            {"D", d.diffusion},
            {"sigma_tr", d.sigma_tr},
            {"A", d.a_j},
            {"z_r", d.z_r},
            {"z_v", d.z_v},
            {"fdr_int", d.fdr_int},
            {"fdt_ext", d.fdt_ext}};
}

// Profiles.

template <typename Profile>
Json profile_case(const Fields& in) {
    return Profile(in.coefficients()).at(in.number("r", 0, 1e9));
}

template <typename Profile>
Json total_case(const Fields& in) {
    return Profile(in.coefficients()).total();
}

Json dipole_disk_case(const Fields& in) {
    return StandardDipole(in.coefficients()).within(in.number("a", 0, 1e9));
}

SurfacePoint point(const Fields& in, const std::string& which) {
    return {in.vector("x_" + which), in.unit_vector("n_" + which)};
}

Json dipole_s_case(const Fields& in) {
    const Coefficients coefficients = in.coefficients();
    const SurfacePoint entry = point(in, "i"), exit = point(in, "o");
    const double value = StandardDipole(coefficients).at(length(exit.position - entry.position));
    const double cos_i = dot(in.unit_vector("w_i"), entry.normal);
    const double cos_o = dot(in.unit_vector("w_o"), exit.normal);
    const auto s = [&](ExitNormalisation normalisation) {
        return bssrdf(value, cos_i, cos_o, coefficients.eta, normalisation);
    };
    return {{"S_normalised", s(ExitNormalisation::transmittance)},
            {"S_jensen2001", s(ExitNormalisation::jensen2001)}};
}

Json directional_case(const Fields& in) {
    const DirectionalDipole dipole = directional_dipole(in.coefficients());
    const SurfacePoint entry = point(in, "i"), exit = point(in, "o");
    const Vec3 to_light = in.unit_vector("w_i"), to_viewer = in.unit_vector("w_o");
    const Vec3 inward = refracted(to_light, entry.normal, dipole.eta);
    const Diffused value = diffused(dipole, ray_pair(entry, inward, exit, dipole.touching));
    return {{"S_d", value.s_d},
            {"d_r", value.d_r},
            {"d_v", value.d_v},
            {"S", bssrdf(dipole, entry, to_light, exit, to_viewer)}};
}

Json diffusion_case(const Fields& in) {
    const NormalisedDiffusion profile(1, in.positive("d"));
    return {{"profile", profile.at(in.positive("r"))},
            {"cdf", profile.within(in.positive("r"))},
            {"sample", profile.sample(in.number("u", 0, 1))}};
}

Json diffusion_shape_case(const Fields& in) {
    const double albedo = in.number("A", 0, 1);
    return {{"searchlight_mfp", diffusion_shape(albedo, DiffusionFit::searchlight_mfp)},
            {"diffuse_mfp", diffusion_shape(albedo, DiffusionFit::diffuse_mfp)},
            {"diffuse_dmfp", diffusion_shape(albedo, DiffusionFit::diffuse_dmfp)}};
}

// Thin layers.

double phase_mean(const Fields& in, const std::string& name) {
    const double g = in.number(name);
    if (!(std::abs(g) < 1)) in.refuse(name, "is not between -1 and 1");
    return g;
}

ThinLayer layer(const Fields& in) {
    ThinLayer result;
    result.tau = in.number("tau", 0, 1e9);
    result.albedo = in.number("W", 0, 1);
    result.g = phase_mean(in, "g");
    result.eta = in.number("eta", 1, 10);
    result.eta_below = in.number_or("eta3", 1);
    if (!(result.eta_below > 0)) in.refuse("eta3", "is not above 0");
    return result;
}

Json phase_case(const Fields& in) {
    return henyey_greenstein(in.number("cos_j", -1, 1), phase_mean(in, "g"));
}

Json reflect_case(const Fields& in) {
    return reflected(layer(in), in.unit_vector("w_i"), in.unit_vector("w_o"));
}

Json transmit_case(const Fields& in) {
    return transmitted(layer(in), in.unit_vector("w_i"), in.unit_vector("w_o"));
}

Json unscattered_case(const Fields& in) {
    return unscattered({.tau = in.number("tau", 0, 1e9),
                        .eta = in.number("eta", 1, 10),
                        .eta_below = in.positive("eta3")},
                       in.number("cos_i", 0, 1));
}

Json energy_case(const Fields& in) {
    const double cos_i = std::cos(in.number("theta_i_deg", 0, 90) * degree);
    const LayerEnergy energy = layer_energy(layer(in), cos_i);
    return {{"R_surface", energy.surface},
            {"R1", energy.reflected},
            {"T1", energy.transmitted},
            {"T0", energy.unscattered}};
}

// Highlights.

Json frame_case(const Fields& in) {
    const Frame frame = highlight_frame(in.unit_vector("n"));
    return {{"t", list_of(frame.t)}, {"b", list_of(frame.b)}, {"n", list_of(frame.n)}};
}

Lobe lobe_of(LobeKind kind, const Fields& in) {
    Lobe lobe;
    lobe.kind = kind;
    lobe.n_t = kind == LobeKind::lafortune ? in.number("n_t") : in.number("n_t", 0, 1e9);
    lobe.n_b = kind == LobeKind::lafortune ? in.number("n_b") : in.number("n_b", 0, 1e9);
    if (kind == LobeKind::ashikhmin) lobe.eta = in.positive("eta");
    if (kind == LobeKind::lafortune) {
        lobe.n_n = in.number_or("n_n", 1);
        lobe.exponent = in.positive("k");
    }
    return lobe;
}

template <LobeKind kind>
Json lobe_case(const Fields& in) {
    return value(lobe_of(kind, in), highlight_frame(in.unit_vector("n")), in.unit_vector("w_i"),
                 in.unit_vector("w_o"));
}

// Fields.

constexpr int largest_field = 1024;

AnalyticField field_of(const Fields& in) {
    const Fields field = in.object("field");
    return {field.integer("n", 1, largest_field),
            field.positive("dx"),
            field.number("amp"),
            field.number("kx"),
            field.number("ky"),
            field.number_or("slope", 0)};
}

Vec3 light_of(const Fields& in) {
    const auto angles = in.numbers("light_deg", 2);
    const double theta = angles[0] * degree, phi = angles[1] * degree;
    return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

int texel(double number, const AnalyticField& field, const Fields& in, const std::string& name) {
    if (!(number >= 0 && number < field.n && number == std::floor(number)))
        in.refuse(name, "is not a point of the field");
    return int(number);
}

Json highlight_field_case(const Fields& in) {
    static const std::map<std::string, LobeKind> models = {{"ward", LobeKind::ward},
                                                           {"ward_duer", LobeKind::ward_duer},
                                                           {"ashikhmin", LobeKind::ashikhmin},
                                                           {"lafortune", LobeKind::lafortune}};
    const auto model = models.find(in.text("model"));
    if (model == models.end()) in.refuse("model", "is not a lobe");
    const AnalyticField field = field_of(in);
    const Lobe lobe = lobe_of(model->second, in);
    const auto query = in.numbers("query", 2);
    const int i = texel(query[0], field, in, "query"), j = texel(query[1], field, in, "query");
    const Vec3 to_light = light_of(in), to_viewer = in.unit_vector("w_o");
    const HighlightFalloff falloff{in.positive("sigma")};
    const double carried = carried_highlight(field, lobe, falloff.sigma, to_light, to_viewer, i, j);
    return {{"H_proposed", carried},
            {"H_normalised", falloff.normalisation() * carried},
            {"H_traditional", local_highlight(field, lobe, to_light, to_viewer, i, j)}};
}

// Of the trees' errors in a file's "out" nothing is computed here: they are a bar, no values.
Json hierarchical_case(const Fields& in) {
    const AnalyticField field = field_of(in);
    const Coefficients coefficients = in.coefficients();
    const Vec3 to_light = light_of(in);
    Json sums = Json::array();
    for (const auto& query : in.rows("queries", 2))
        sums.push_back(exitance(field, coefficients, to_light, texel(query[0], field, in, "queries"),
                                texel(query[1], field, in, "queries")));
    return {{"Mo_brute", sums}};
}

// Stalks.

Json backbone_case(const Fields& in) {
    std::vector<Vec3> control;
    for (const auto& row : in.rows("control_points", 3))
        control.push_back({row[0], row[1], row[2]});
    if (control.size() < 4) in.refuse("control_points", "are fewer than 4");
    const auto points = backbone(control, in.integer("steps_per_segment", 1, 10'000));
    Json listed = Json::array(), frames = Json::array();
    for (const Vec3 p : points) listed.push_back(list_of(p));
    for (const StalkFrame& frame : stalk_frames(points, in.vector("B0")))
        frames.push_back({{"T", list_of(frame.tangent)},
                          {"N", list_of(frame.normal)},
                          {"B", list_of(frame.binormal)}});
    return {{"points", listed}, {"frames", frames}};
}

using Function = Json (*)(const Fields&);

const std::map<std::string, Function> functions = {
    {"fresnel", fresnel_case},
    {"moments", moments_case},
    {"boundary", boundary_case},
    {"derived", derived_case},
    {"dipole_rd", profile_case<StandardDipole>},
    {"dipole_disk", dipole_disk_case},
    {"dipole_total", total_case<StandardDipole>},
    {"better_dipole_rd", profile_case<BetterDipole>},
    {"better_dipole_total", total_case<BetterDipole>},
    {"dipole_S", dipole_s_case},
    {"dirdipole", directional_case},
    {"nd", diffusion_case},
    {"nd_s", diffusion_shape_case},
    {"hg", phase_case},
    {"hk_reflect", reflect_case},
    {"hk_transmit", transmit_case},
    {"hk_t0", unscattered_case},
    {"hk_energy", energy_case},
    {"frame", frame_case},
    {"ward", lobe_case<LobeKind::ward>},
    {"ward_duer", lobe_case<LobeKind::ward_duer>},
    {"ashikhmin", lobe_case<LobeKind::ashikhmin>},
    {"lafortune", lobe_case<LobeKind::lafortune>},
    {"highlight_field", highlight_field_case},
    {"hierarchical", hierarchical_case},
    {"backbone", backbone_case},
};

}  // namespace

Json evaluated(const std::string& fn, const Fields& in) {
    const auto function = functions.find(fn);
    if (function == functions.end()) throw BadCase("fn", "is no function: \"" + fn + '"');
    return function->second(in);
}

}  // namespace relit::test::reference
