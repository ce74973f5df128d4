#include "core/scatter/medium.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "core/scatter/dipole.h"
#include "tests/core/scatter/support.h"

namespace relit::test {
namespace {

using namespace scatter;

TEST(MeasuredMedia, HaveNamesOfTheirOwnAndTitles) {
    std::set<std::string> names, titles;
    for (const NamedMedium& medium : measured_media()) {
        const std::string name(medium.name);
        EXPECT_TRUE(names.insert(name).second) << name;
        EXPECT_EQ(name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-"), name.npos)
            << name;
        EXPECT_TRUE(titles.insert(std::string(medium.title)).second) << name;
        EXPECT_FALSE(medium.source.empty()) << name;
        EXPECT_EQ(find_medium(name), &medium);
    }
    EXPECT_EQ(names.size(), 20u);
    EXPECT_EQ(find_medium("Marble"), nullptr);
    EXPECT_EQ(find_medium(""), nullptr);
}

struct Reflectance {
    const char* name;
    double red, green, blue;
};

// Jensen and others 2001, table 1, with the totals that the specification computes from it (the
// paper's own column agrees to 0.01, in a few cells 0.03).
TEST(MeasuredMedia, OfJensenReflectWhatTheirTableSays) {
    constexpr Reflectance rows[] = {
        {"apple", .846, .841, .528},    {"chicken1", .314, .156, .126},
        {"chicken2", .321, .160, .108}, {"cream", .976, .900, .725},
        {"ketchup", .164, .006, .002},  {"marble", .830, .791, .753},
        {"potato", .764, .613, .213},   {"skim-milk", .815, .813, .682},
        {"skin1", .436, .227, .131},    {"skin2", .623, .433, .343},
        {"spectralon", 1, 1, 1},        {"whole-milk", .908, .881, .759},
    };
    std::size_t of_jensen = 0;
    for (const NamedMedium& medium : measured_media())
        of_jensen += medium.source == "Jensen et al. 2001";
    EXPECT_EQ(of_jensen, std::size(rows));
    for (const Reflectance& row : rows) {
        const double expected[] = {row.red, row.green, row.blue};
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(StandardDipole(measured(row.name, c)).total(), expected[c], 6e-4)
                << row.name << ' ' << c;
    }
}

// Narasimhan and others 2006: their sigma_s' = sigma_s (1 - g), as other tables print it.
TEST(MeasuredMedia, OfNarasimhanHaveTheirReducedScattering) {
    constexpr Reflectance rows[] = {
        {"chocolate-milk-regular", 1.4585, 2.1289, 2.9527},
        {"chocolate-milk-lowfat", 0.6492, 0.8392, 1.1057},
        {"milk-lowfat", 0.8919, 1.5136, 2.5320},
        {"milk-reduced", 2.4858, 3.1669, 4.5214},
        {"milk-regular", 4.5513, 5.8294, 7.1360},
        {"soy-milk-regular", 0.5922, 0.7387, 1.4693},
        {"espresso", 0.7238, 0.8456, 1.0247},
        {"white-grapefruit-juice", 0.2283, 0.2400, 0.3275},
    };
    for (const Reflectance& row : rows) {
        const double expected[] = {row.red, row.green, row.blue};
        for (int c = 0; c < 3; ++c)
            EXPECT_NEAR(derived(measured(row.name, c)).sigma_s_prime, expected[c], 6e-5)
                << row.name << ' ' << c;
        EXPECT_EQ(find_medium(row.name)->source, "Narasimhan et al. 2006");
        EXPECT_EQ(find_medium(row.name)->medium.eta, 1.33);
    }
}

TEST(Channel, ScalesWhatHasALengthAndNothingElse) {
    const Medium& milk = find_medium("chocolate-milk-regular")->medium;
    const Coefficients green = channel(milk, 1, 80);
    EXPECT_DOUBLE_EQ(green.sigma_s, 80 * 13.1416);
    EXPECT_DOUBLE_EQ(green.sigma_a, 80 * 0.04313);
    EXPECT_EQ(green.g, 0.838);
    EXPECT_EQ(green.eta, 1.33);
}

TEST(Derived, LengthsShrinkAsCoefficientsGrow) {
    const Coefficients one = measured("skin1", 1);
    const Coefficients scaled{80 * one.sigma_a, 80 * one.sigma_s, one.g, one.eta};
    const Derived a = derived(one), b = derived(scaled);
    EXPECT_NEAR(b.sigma_tr, 80 * a.sigma_tr, 1e-10);
    EXPECT_NEAR(b.z_r, a.z_r / 80, 1e-14);
    EXPECT_NEAR(b.z_v, a.z_v / 80, 1e-14);
    EXPECT_NEAR(b.diffusion, a.diffusion / 80, 1e-14);
    EXPECT_NEAR(b.alpha_prime, a.alpha_prime, 1e-14);
    EXPECT_NEAR(a.z_v, a.z_r * (1 + 4 * a.a_j / 3), 1e-14);
    EXPECT_NEAR(a.fdt_ext, 4 * a.c_phi_ext, 1e-14);
}

TEST(Derived, AMediumThatAbsorbsNothingHasFiniteLengths) {
    const Derived d = derived(measured("spectralon", 0));
    EXPECT_NEAR(d.sigma_a / d.sigma_t_prime, 1e-8, 1e-15);
    EXPECT_GT(d.sigma_tr, 0);
    EXPECT_NEAR(d.alpha_prime, 1, 1e-7);
}

}  // namespace
}  // namespace relit::test
