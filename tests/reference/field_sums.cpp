#include "tests/reference/field_sums.h"

#include <algorithm>
#include <cmath>

#include "core/scatter/dipole.h"
#include "core/scatter/fresnel.h"
#include "core/scatter/highlight.h"

namespace relit::test::reference {

FieldPoint point_of(const AnalyticField& f, int i, int j) {
    const double x = (i - (f.n - 1) / 2.0) * f.dx, y = (j - (f.n - 1) / 2.0) * f.dx;
    const double h = f.amp * std::sin(f.kx * x) * std::cos(f.ky * y) + f.slope * x;
    const double h_x = f.amp * f.kx * std::cos(f.kx * x) * std::cos(f.ky * y) + f.slope;
    const double h_y = -f.amp * f.ky * std::sin(f.kx * x) * std::sin(f.ky * y);
    const Vec3 normal = normalized({-h_x, -h_y, 1});
    return {{x, y, h}, normal, f.dx * f.dx / normal.z};
}

double exitance(const AnalyticField& field, const scatter::Coefficients& coefficients,
                Vec3 to_light, int i, int j) {
    const scatter::StandardDipole dipole(coefficients);
    const FieldPoint exit = point_of(field, i, j);
    double sum = 0;
    for (int row = 0; row < field.n; ++row)
        for (int column = 0; column < field.n; ++column) {
            const FieldPoint entry = point_of(field, column, row);
            const double cos_i = std::max(0.0, dot(to_light, entry.normal));
            sum += dipole.at(length(exit.position - entry.position)) * cos_i *
                   scatter::transmittance(cos_i, coefficients.eta) * entry.area;
        }
    return sum;
}

double local_highlight(const AnalyticField& field, const scatter::Lobe& lobe, Vec3 to_light,
                       Vec3 to_viewer, int i, int j) {
    const scatter::Frame frame = scatter::highlight_frame(point_of(field, i, j).normal);
    return scatter::value(lobe, frame, to_light, to_viewer);
}

double carried_highlight(const AnalyticField& field, const scatter::Lobe& lobe, double sigma,
                         Vec3 to_light, Vec3 to_viewer, int i, int j) {
    const scatter::HighlightFalloff falloff{sigma};
    const FieldPoint exit = point_of(field, i, j);
    double sum = 0;
    for (int row = 0; row < field.n; ++row)
        for (int column = 0; column < field.n; ++column) {
            const FieldPoint entry = point_of(field, column, row);
            sum += local_highlight(field, lobe, to_light, to_viewer, column, row) *
                   falloff.at(length(exit.position - entry.position)) * entry.area;
        }
    return sum;
}

}  // namespace relit::test::reference
