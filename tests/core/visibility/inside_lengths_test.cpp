#include "core/visibility/inside_lengths.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/angle.h"
#include "core/field/normals.h"
#include "core/shade/factors.h"
#include "core/visibility/inside_length.h"
#include "tests/support/maps.h"
#include "tests/support/tolerances.h"

namespace relit::test {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

std::vector<double> packet_lengths(const Solid& solid, const RayTarget& target,
                                   const std::vector<Vec3>& from, Simd simd = best_simd()) {
    std::vector<double> r(from.size());
    PacketSolid(solid, executor(), simd).inside_lengths(target, from, r);
    return r;
}

// The rays `from` that start near the texels of one square, as a tile.
RayTile tile_of(const Solid& solid, int column, int row, const std::vector<Vec3>& from) {
    RayTile tile;
    tile.column = column;
    tile.row = row;
    for (const Vec3& p : from) {
        tile.right[tile.count] = float(p.x * solid.width - 0.5 - column);
        tile.down[tile.count] = float(solid.height - 0.5 - p.y * solid.width - row);
        tile.z[tile.count++] = float(p.z);
    }
    return tile;
}

// Calls `visit` with each square of a map and the places of its texels in a list row by row; texels
// beyond the map's end are those at it.
template <class Visit>
void for_each_square(const Solid& solid, const Visit& visit) {
    constexpr int side = RayTile::side;
    for (int row = 0; row < solid.height; row += side)
        for (int column = 0; column < solid.width; column += side) {
            std::vector<std::size_t> places;
            for (int j = row; j < row + side; ++j)
                for (int i = column; i < column + side; ++i)
                    places.push_back(std::size_t(std::min(j, solid.height - 1)) * solid.width +
                                     std::min(i, solid.width - 1));
            visit(column, row, places);
        }
}

std::vector<Vec3> picked(const std::vector<Vec3>& all, const std::vector<std::size_t>& places) {
    std::vector<Vec3> some;
    for (const std::size_t place : places) some.push_back(all[place]);
    return some;
}

// r of every texel of a map, square by square.
std::vector<float> tile_lengths(const PacketSolid& packets, const Solid& solid,
                                const RayTarget& target, const std::vector<Vec3>& from) {
    std::vector<float> r(from.size());
    for_each_square(solid, [&](int column, int row, const std::vector<std::size_t>& places) {
        std::array<float, RayTile::max_rays> found;
        packets.inside_lengths(target, tile_of(solid, column, row, picked(from, places)), found);
        for (std::size_t k = 0; k < places.size(); ++k) r[places[k]] = found[k];
    });
    return r;
}

// p' of every texel of a map, row by row.
std::vector<Vec3> starts_of(const Solid& solid, const HeightField& field, double relief,
                            double depth, Offset offset) {
    std::vector<Vec3> starts;
    for (int j = 0; j < solid.height; ++j)
        for (int i = 0; i < solid.width; ++i) {
            const Vec3 m = offset == Offset::normal ? normal_from(slopes_at(field, relief, i, j))
                                                    : Vec3{0, 0, 1};
            starts.push_back(surface_point(solid, i, j) - depth * m);
        }
    return starts;
}

struct Errors {
    double squares = 0;
    int rays = 0;
    [[nodiscard]] double psnr_db() const {
        return -10 * std::log10(std::max(squares / rays, 1e-12));
    }
};

// Adds the differences of d between r and the scalar march.
template <class Number>
void compare(const Solid& solid, const RayTarget& target, const std::vector<Vec3>& from,
             double depth, const std::vector<Number>& r, Errors& errors) {
    for (std::size_t k = 0; k < from.size(); ++k) {
        const double exact = inside_length(solid, ray_to(target, from[k]));
        ASSERT_EQ(std::isinf(r[k]), std::isinf(exact)) << "ray " << k;
        ASSERT_GE(r[k], 0) << "ray " << k;
        const double e = length_illumination(depth, r[k]) - length_illumination(depth, exact);
        errors.squares += e * e;
        ++errors.rays;
    }
}

void mask_blobs(HeightField& field, Random& random) {
    field.alpha = Image(field.width(), field.height(), 1, 1);
    for (int blob = 0; blob < 6; ++blob) {
        const double x = random() * field.width(), y = random() * field.height();
        const double radius = random() * 0.2 * field.width();
        for (int j = 0; j < field.height(); ++j)
            for (int i = 0; i < field.width(); ++i)
                if (std::hypot(i - x, j - y) < radius) field.alpha.at(i, j) = 0;
    }
}

// Lights far, near, level, in the ground, behind, inside the map, straight above and below, along
// rows, columns and diagonals.
std::vector<RayTarget> targets_around(Random& random) {
    const double azimuth = random() * 360;
    return {
        {{random() * 2 - 0.5, random() * 2 - 0.5, random()}, false},
        {{random() * 2e3 - 1e3, random() * 2e3 - 1e3, random() * 1e3}, false},
        {{random(), random(), 0.3}, false},
        {{random(), random(), 0.05}, false},
        {{random(), random(), 0}, false},
        {{random(), random(), -0.3}, false},
        {direction_from(azimuth, 60), true},
        {direction_from(azimuth, 8), true},
        {direction_from(azimuth, 89.99), true},
        {direction_from(azimuth, -30), true},
        {direction_from(azimuth, 0), true},
        {direction_from(45, 20), true},
        {{0, 0, 1}, true},
        {{0, 0, -1}, true},
        {{1, 0, 0}, true},
        {{0, -0.8, 0.6}, true},
    };
}

struct RandomScene {
    HeightField field;
    double relief = 0.2, depth = 0.01;
    Solid solid;
    std::vector<Vec3> starts;
};

// Hills of any shape of map; by turns masked, with each base, offset both ways.
RandomScene random_scene(int trial, Random& random) {
    RandomScene scene;
    scene.field = hills(3 + int(random() * 90), 3 + int(random() * 90), 100 + trial);
    if (trial % 4 > 1)  // plains at 0, where rays start in the ground
        for (float& h : scene.field.heights.values) h = std::max(0.0f, 1.5f * h - 0.5f);
    if (trial % 2) mask_blobs(scene.field, random);
    const Base bases[] = {
        {}, {Base::Kind::automatic, 0}, {Base::Kind::level, 0.04}, {Base::Kind::level, -0.1}};
    scene.solid = make_solid(scene.field, scene.relief, bases[trial / 2 % 4], scene.depth);
    scene.starts = starts_of(scene.solid, scene.field, scene.relief, scene.depth,
                             trial % 3 ? Offset::normal : Offset::view);
    return scene;
}

TEST(InsideLengths, AreThoseOfTheScalarMarchOnEveryInstructionSet) {
    for (const Simd simd : available_simd()) {
        SCOPED_TRACE(name_of(simd));
        Random random(3);
        for (int trial = 0; trial < 24; ++trial) {
            const RandomScene scene = random_scene(trial, random);
            Errors errors;
            for (const RayTarget& target : targets_around(random)) {
                SCOPED_TRACE(testing::Message() << "trial " << trial << " towards " << target.at.x
                                                << " " << target.at.y << " " << target.at.z);
                compare(scene.solid, target, scene.starts, scene.depth,
                        packet_lengths(scene.solid, target, scene.starts, simd), errors);
            }
            EXPECT_GE(errors.psnr_db(), tolerance::packet_hills_psnr_db) << "trial " << trial;
        }
    }
}

TEST(InsideLengths, OfTilesAreThoseOfTheScalarMarchOnEveryInstructionSet) {
    for (const Simd simd : available_simd()) {
        SCOPED_TRACE(name_of(simd));
        Random random(4);
        for (int trial = 0; trial < 24; ++trial) {
            const RandomScene scene = random_scene(trial, random);
            const PacketSolid packets(scene.solid, executor(), simd);
            Errors errors;
            for (const RayTarget& target : targets_around(random)) {
                SCOPED_TRACE(testing::Message() << "trial " << trial << " towards " << target.at.x
                                                << " " << target.at.y << " " << target.at.z);
                compare(scene.solid, target, scene.starts, scene.depth,
                        tile_lengths(packets, scene.solid, target, scene.starts), errors);
            }
            EXPECT_GE(errors.psnr_db(), tolerance::packet_hills_psnr_db) << "trial " << trial;
        }
    }
}

TEST(InsideLengths, OfTilesHoldOnRoughMapsOfEverySmallSize) {
    Random random(12);
    Errors errors;
    for (int trial = 0; trial < 400; ++trial) {
        const Solid solid = rough_solid(trial, random);
        const PacketSolid packets(solid, executor());
        std::vector<Vec3> starts(std::size_t(solid.width) * solid.height);
        for (Vec3& p : starts)
            p = {random() * 1.2 - 0.1, (random() * 1.2 - 0.1) * solid.y_size(),
                 random() * 0.8 - 0.05};
        for (const RayTarget& target : targets_around(random))
            compare(solid, target, starts, 0.05, tile_lengths(packets, solid, target, starts),
                    errors);
    }
    EXPECT_GE(errors.psnr_db(), tolerance::packet_rough_psnr_db);
}

TEST(InsideLengths, OfTilesAreTheSameBytesOnEveryInstructionSetAndInAnyCompany) {
    Random random(7);
    for (int trial = 0; trial < 12; ++trial) {
        const RandomScene scene = random_scene(trial, random);
        const PacketSolid portable(scene.solid, executor(), Simd::portable);
        for (const RayTarget& target : targets_around(random)) {
            const std::vector<float> r = tile_lengths(portable, scene.solid, target, scene.starts);
            for (const Simd simd : available_simd()) {
                const PacketSolid packets(scene.solid, executor(), simd);
                ASSERT_EQ(tile_lengths(packets, scene.solid, target, scene.starts), r)
                    << name_of(simd) << ", trial " << trial;
                for_each_square(
                    scene.solid, [&](int column, int row, std::vector<std::size_t> places) {
                        for (std::size_t k = places.size(); k > 1; --k)
                            std::swap(places[k - 1], places[std::size_t(random() * double(k))]);
                        places.resize(1 + std::size_t(random() * 40));
                        std::array<float, RayTile::max_rays> found;
                        packets.inside_lengths(
                            target, tile_of(scene.solid, column, row, picked(scene.starts, places)),
                            found);
                        for (std::size_t k = 0; k < places.size(); ++k)
                            ASSERT_EQ(found[k], r[places[k]])
                                << name_of(simd) << ", texel " << places[k] << ", trial " << trial
                                << " towards " << target.at.x << " " << target.at.y << " "
                                << target.at.z;
                    });
            }
        }
    }
}

HeightField cliffs(int width, int height) {
    HeightField field = hills(width, height, 5);
    Random random(12);
    for (int column = 0; column < 40; ++column) {
        const int left = int(random() * (width - 3)), top = int(random() * (height - 3));
        const float z = float(random());
        for (int j = top; j < top + 3; ++j)
            for (int i = left; i < left + 3; ++i) field.heights.at(i, j) = z;
    }
    return field;
}

HeightField terraces(int width, int height) {
    HeightField field = hills(width, height, 6);
    for (float& h : field.heights.values) h = std::floor(h * 40) / 40;
    return field;
}

HeightField noise(int width, int height) {
    Random random(14);
    return field_of(width, height, [&](int, int) { return random(); });
}

// Which steps are solved for is a matter of the company: of the block's steepest kink, and of where the
// stretches end.
TEST(InsideLengths, OfTilesOnRoughMapsAreTheSameInAnyCompany) {
    Random random(15);
    for (const HeightField& field : {cliffs(203, 150), terraces(150, 203), noise(99, 99)}) {
        constexpr double relief = 0.25, depth = 0.01;
        const Solid solid = make_solid(field, relief, {}, depth);
        const std::vector<Vec3> starts = starts_of(solid, field, relief, depth, Offset::normal);
        const PacketSolid packets(solid, executor());
        const PacketSolid portable(solid, executor(), Simd::portable);
        for (const RayTarget& target : targets_around(random)) {
            SCOPED_TRACE(testing::Message()
                         << "towards " << target.at.x << " " << target.at.y << " " << target.at.z);
            const std::vector<float> r = tile_lengths(packets, solid, target, starts);
            ASSERT_EQ(tile_lengths(portable, solid, target, starts), r);
            for_each_square(
                solid, [&](int column, int row, const std::vector<std::size_t>& places) {
                    for (std::size_t k = 0; k < places.size(); k += 3) {
                        std::array<float, RayTile::max_rays> alone;
                        packets.inside_lengths(
                            target, tile_of(solid, column, row, {starts[places[k]]}), alone);
                        ASSERT_EQ(alone[0], r[places[k]]) << "texel " << places[k];
                    }
                });
        }
    }
}

TEST(InsideLengths, HoldOnRoughMapsOfEverySmallSize) {
    Random random(11);
    Errors errors;
    for (int trial = 0; trial < 400; ++trial) {
        const Solid solid = rough_solid(trial, random);
        std::vector<Vec3> starts(20);  // some beyond the border, some above the surface
        for (Vec3& p : starts)
            p = {random() * 1.2 - 0.1, (random() * 1.2 - 0.1) * solid.y_size(),
                 random() * 0.8 - 0.05};
        for (const RayTarget& target : targets_around(random))
            compare(solid, target, starts, 0.05, packet_lengths(solid, target, starts), errors);
    }
    EXPECT_GE(errors.psnr_db(), tolerance::packet_rough_psnr_db);
}

TEST(InsideLengths, AreTheSameBytesOnEveryInstructionSet) {
    Random random(5);
    for (int trial = 0; trial < 12; ++trial) {
        const RandomScene scene = random_scene(trial, random);
        for (const RayTarget& target : targets_around(random)) {
            const std::vector<double> expected =
                packet_lengths(scene.solid, target, scene.starts, Simd::portable);
            for (const Simd simd : available_simd())
                EXPECT_EQ(packet_lengths(scene.solid, target, scene.starts, simd), expected)
                    << name_of(simd) << ", trial " << trial;
        }
    }
}

// Packets, windows and skipped blocks depend on a ray's company; its r must not.
TEST(InsideLengths, DoNotDependOnTheOtherRaysOrTheirOrder) {
    Random random(6);
    for (int trial = 0; trial < 12; ++trial) {
        const RandomScene scene = random_scene(trial, random);
        std::vector<std::size_t> order(scene.starts.size());
        for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
        for (std::size_t k = order.size(); k > 1; --k)
            std::swap(order[k - 1], order[std::size_t(random() * double(k))]);
        std::vector<Vec3> shuffled;
        for (const std::size_t k : order) shuffled.push_back(scene.starts[k]);
        const PacketSolid packets(scene.solid, executor());
        for (const RayTarget& target : targets_around(random)) {
            const std::vector<double> r = packet_lengths(scene.solid, target, scene.starts);
            const std::vector<double> mixed = packet_lengths(scene.solid, target, shuffled);
            for (std::size_t k = 0; k < order.size(); ++k)
                ASSERT_EQ(mixed[k], r[order[k]]) << "ray " << order[k] << ", trial " << trial;
            for (std::size_t k = 0; k < order.size(); k += 37) {
                double alone = -1;
                packets.inside_lengths(target, {&scene.starts[k], 1}, {&alone, 1});
                ASSERT_EQ(alone, r[k]) << "ray " << k << ", trial " << trial;
            }
        }
    }
}

TEST(InsideLengths, OnAPlaneGiveTheCosineForEveryTiltAndDepth) {
    for (const double slope_x : {0.0, 0.2, -0.35})
        for (const double slope_y : {0.0, 0.3})
            for (const double depth : {0.002, 0.008, 0.02}) {
                const HeightField field = tilted_plane(97, 64, 0.6, slope_x, slope_y);
                const Solid plane = make_solid(field, 0.6, {}, depth);
                const Vec3 n = normal_from(slopes_at(field, 0.6, 48, 32));
                const std::vector<Vec3> from{surface_point(plane, 48, 32) - depth * n};
                for (const double azimuth : {0.0, 45.0, 133.0, 270.0}) {
                    const Vec3 l = direction_from(azimuth, 60);
                    const double r = packet_lengths(plane, {l, true}, from)[0];
                    EXPECT_NEAR(length_illumination(depth, r), dot(n, l), tolerance::plane_d);
                }
            }
}

TEST(InsideLengths, StraightUpAreTheDepthEverywhere) {
    for (const int width : {1, 2, 33, 257}) {
        const HeightField field = hills(width, 41);
        const Solid solid = make_solid(field, 0.3, {}, 0.01);
        for (const Vec3 l : {Vec3{0, 0, 1}, direction_from(77, 90), direction_from(77, 89.9999)})
            for (const double r :
                 packet_lengths(solid, {l, true}, starts_of(solid, field, 0.3, 0.01, Offset::view)))
                ASSERT_NEAR(r, 0.01, 3e-7) << width;
    }
}

// Floats have no fractions of a texel there: the scalar march takes these.
TEST(InsideLengths, OfRaysFromFarAwayAreLeftToTheScalarMarch) {
    const Solid solid = make_solid(field_of(32, 32, [](int, int) { return 1; }), 0.3,
                                   {Base::Kind::level, -0.3}, 0.01);
    const std::vector<Vec3> from{{-3e6, 0.5, 0.1}, {0.4, 2e7, 0.1}, {0.5, 0.5, 4e6}};
    const RayTarget targets[] = {{{0.5, 0.5, 0.1}, false}, {{0.3, 0.6, -0.2}, false}};
    for (const RayTarget& target : targets) {
        const std::vector<double> r = packet_lengths(solid, target, from);
        for (std::size_t k = 0; k < from.size(); ++k) {
            const double exact = inside_length(solid, ray_to(target, from[k]));
            EXPECT_EQ(r[k], exact) << k;
            EXPECT_GT(exact, 0) << k;
        }
    }
    const RayTarget beyond{{1e20, 3e19, 2e19}, false};
    const std::vector<Vec3> start{{0.5, 0.5, 0.1}};
    EXPECT_EQ(packet_lengths(solid, beyond, start)[0],
              inside_length(solid, ray_to(beyond, start[0])));
}

TEST(InsideLengths, AreEndlessForEveryLightInOrBehindEndlessGround) {
    const HeightField field = hills(40, 24);
    const Solid solid = make_solid(field, 0.3, {}, 0.01);
    const auto starts = starts_of(solid, field, 0.3, 0.01, Offset::normal);
    for (const RayTarget& target :
         {RayTarget{{0.5, 0.5, -0.35}, false}, RayTarget{direction_from(20, -0.01), true}})
        for (const double r : packet_lengths(solid, target, starts)) ASSERT_EQ(r, infinity);
    for (const double r : packet_lengths(solid, {{0.5, 0.5, 0}, false}, starts))
        ASSERT_LT(r, infinity);
}

}  // namespace
}  // namespace relit::test
