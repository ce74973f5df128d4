#include "core/light/path.h"

#include <gtest/gtest.h>

#include <set>

namespace relit {
namespace {

constexpr Easing easings[] = {Easing::linear, Easing::ease_in, Easing::ease_out,
                              Easing::ease_in_out};

TEST(PathShare, OpenPathsHaveAFrameAtEitherEnd) {
    for (const Easing easing : easings) {
        EXPECT_EQ(path_share(0, 5, PathEnds::open, easing), 0);
        EXPECT_EQ(path_share(4, 5, PathEnds::open, easing), 1);
        EXPECT_EQ(path_share(0, 1, PathEnds::open, easing), 0);
    }
    EXPECT_EQ(path_share(1, 5, PathEnds::open, Easing::linear), 0.25);
}

// Played in a loop, the last frame is followed by the first in the same step as any other.
TEST(PathShare, ClosedPathsEndOneStepBeforeTheirBeginning) {
    EXPECT_EQ(path_share(0, 4, PathEnds::closed, Easing::linear), 0);
    EXPECT_EQ(path_share(3, 4, PathEnds::closed, Easing::linear), 0.75);
}

TEST(PathShare, ReturningPathsReachTheEndOnceAndDoubleNoFrame) {
    std::vector<double> shares;
    for (int i = 0; i < 4; ++i)
        shares.push_back(path_share(i, 4, PathEnds::returns, Easing::linear));
    EXPECT_EQ(shares, (std::vector<double>{0, 0.5, 1, 0.5}));
}

TEST(PathShare, NeverGoesBackAndEasesWhereItSays) {
    for (const Easing easing : easings)
        for (int i = 1; i < 100; ++i)
            EXPECT_GT(path_share(i, 100, PathEnds::open, easing),
                      path_share(i - 1, 100, PathEnds::open, easing));
    const auto step = [](int i, Easing easing) {
        return path_share(i + 1, 101, PathEnds::open, easing) -
               path_share(i, 101, PathEnds::open, easing);
    };
    EXPECT_LT(step(0, Easing::ease_in), 0.001);
    EXPECT_GT(step(99, Easing::ease_in), 0.01);
    EXPECT_GT(step(0, Easing::ease_out), 0.01);
    EXPECT_LT(step(99, Easing::ease_out), 0.001);
    EXPECT_LT(step(0, Easing::ease_in_out), 0.001);
    EXPECT_LT(step(99, Easing::ease_in_out), 0.001);
    EXPECT_NEAR(path_share(50, 101, PathEnds::open, Easing::ease_in_out), 0.5, 1e-12);
}

TEST(Between, AnglesGoTheWayThatIsSaid) {
    EXPECT_EQ(between(Angles{350, 0}, Angles{370, 40}, 0.5).azimuth_deg, 0);
    EXPECT_EQ(between(Angles{350, 0}, Angles{370, 40}, 0.5).elevation_deg, 20);
    EXPECT_EQ(between(Angles{350, 0}, Angles{10, 0}, 0.5).azimuth_deg, 180);
    EXPECT_EQ(between(Vec3{0, 1, 2}, Vec3{1, 1, 0}, 0.5), (Vec3{0.5, 1, 1}));
}

TEST(WithinATurn, IsTheSameDirection) {
    EXPECT_EQ(within_a_turn(360), 0);
    EXPECT_EQ(within_a_turn(-90), 270);
    EXPECT_EQ(within_a_turn(725), 5);
    EXPECT_LT(within_a_turn(-1e-300), 360);
}

}  // namespace
}  // namespace relit
