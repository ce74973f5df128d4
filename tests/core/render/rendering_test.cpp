// Pictures rendered some rows at a time.
#include <gtest/gtest.h>

#include <algorithm>

#include "core/render/render.h"
#include "tests/support/maps.h"

namespace relit::test {
namespace {

Scene masked_hills() {
    Scene scene;
    HeightField field = hills(150, 110);
    field.alpha = Image(150, 110, 1, 1.0f);
    for (int j = 30; j < 60; ++j)
        for (int i = 40; i < 90; ++i) field.alpha.at(i, j) = i < 50 ? 0.3f : 0.0f;
    scene.field = shared(std::move(field));
    scene.relief = 0.2;
    scene.material.specular.k = 0.3;
    return scene;
}

Image row_by_rows(const Scene& scene, const Output& output, int at_a_time) {
    const Rendering rendering(scene, output, {executor()});
    const PictureFacts& facts = rendering.facts();
    Image all(facts.width, facts.height, facts.channels);
    for (int y = 0; y < facts.height; y += at_a_time) {
        const Image some = rendering.rows({y, std::min(y + at_a_time, facts.height)});
        EXPECT_EQ(some.width, facts.width);
        EXPECT_EQ(some.channels, facts.channels);
        std::copy(some.values.begin(), some.values.end(), all.row(y).begin());
    }
    return all;
}

TEST(Rendering, OfSomeRowsAtATimeIsThePictureNumberByNumber) {
    const Scene scene = masked_hills();
    Output background{.background = hex_colour(10, 20, 30)};
    const Output outputs[] = {{},
                              background,
                              {.linear = true},
                              {.layer = Layer::normal},
                              {.layer = Layer::thickness},
                              {.region = Rect{17, 21, 101, 77}},
                              {.width = 37},
                              {.width = 230, .region = Rect{17, 21, 101, 77}},
                              {.width = 61, .height = 300},
                              {.accuracy = Accuracy::preview, .width = 70}};
    for (std::size_t n = 0; n < std::size(outputs); ++n)
        for (const int rows : {1, 7, 32}) {
            SCOPED_TRACE(testing::Message() << "output " << n << ", " << rows << " rows at a time");
            EXPECT_EQ(row_by_rows(scene, outputs[n], rows).values,
                      render(scene, outputs[n], {executor()}).pixels.values);
        }
}

TEST(Rendering, ReportsProgressThatRisesToOneOverAllRows) {
    const Scene scene = masked_hills();
    std::vector<double> told;
    const Rendering rendering(scene, {},
                              {executor(), {}, [&](double share) { told.push_back(share); }});
    (void)rendering.rows({0, 48});
    ASSERT_FALSE(told.empty());
    EXPECT_DOUBLE_EQ(told.back(), 48.0 / 110);
    (void)rendering.rows({48, 110});
    EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
    EXPECT_EQ(told.back(), 1);
}

}  // namespace
}  // namespace relit::test
