#include "tests/reference/judge.h"

#include <gtest/gtest.h>

#include <sys/wait.h>

#include <cstdlib>
#include <sstream>

namespace relit::test::reference {
namespace {

struct Verdict {
    int status = -1;
    std::string out;
    std::string err;
};

Verdict verdict(const std::string& json) {
    std::ostringstream out, err;
    const int status = judge(json, out, err);
    return {status, out.str(), err.str()};
}

std::string file_of(const std::string& cases) {
    return R"({"format": "translucency-reference/1", "cases": [)" + cases + "]}";
}

constexpr const char* right =
    R"({"id": "right", "fn": "fresnel", "in": {"cos_i": 1, "eta": 1.5}, "out": 0.04, "rtol": 1e-9, "atol": 0})";
constexpr const char* wrong =
    R"({"id": "wrong", "fn": "fresnel", "in": {"cos_i": 1, "eta": 1.5}, "out": 0.05, "rtol": 1e-9, "atol": 0})";

TEST(Judge, CountsTheCasesThatAgreeAndTellsTheOthersNumbers) {
    const Verdict all = verdict(file_of(right));
    EXPECT_EQ(all.status, 0) << all.err;
    EXPECT_EQ(all.out, "right ok\n1 agree, 0 differ, 0 cannot be judged\n");

    const Verdict one = verdict(file_of(std::string(right) + "," + wrong));
    EXPECT_EQ(one.status, 1);
    EXPECT_NE(one.out.find("right ok\nwrong differs: out: expected 0.05, got 0.04"),
              std::string::npos)
        << one.out;
    EXPECT_NE(one.out.find("1 agree, 1 differ, 0 cannot be judged"), std::string::npos) << one.out;
}

// Numbers in lists and objects of "out" count one by one, each by the same tolerances.
TEST(Judge, LooksAtEveryNumberOfACase) {
    const std::string frame =
        R"({"id": "f", "fn": "frame", "in": {"n": [0, 0, 1]}, "out": {"t": [0, 1, 0], "b": [-1, 0, B]}, "rtol": 0, "atol": A})";
    const auto with = [&](const std::string& b, const std::string& tolerance) {
        std::string text = frame;
        text.replace(text.find(", B]"), 4, ", " + b + "]");
        text.replace(text.find(": A}"), 4, ": " + tolerance + "}");
        return verdict(file_of(text));
    };
    EXPECT_EQ(with("0", "0").status, 0);
    EXPECT_EQ(with("0.001", "0.002").status, 0);
    const Verdict differs = with("0.001", "0.0005");
    EXPECT_EQ(differs.status, 1);
    EXPECT_NE(differs.out.find("out.b[2]: expected 0.001"), std::string::npos) << differs.out;
}

struct Broken {
    const char* name;
    std::string cases;
    std::string message;  // of the case, by id and field
};

std::string case_with(const std::string& fn, const std::string& in, const std::string& rest) {
    return R"({"id": "c", "fn": ")" + fn + R"(", "in": )" + in + ", " + rest + "}";
}

TEST(Judge, RefusesCasesByTheirIdAndField) {
    const std::string rest = R"("out": 1, "rtol": 0, "atol": 0)";
    const std::string scattering = R"("sigma_s": 1, "sigma_a": 0.1, "g": 0, "eta": 1.5)";
    const Broken broken[] = {
        {"function", case_with("fresnell", "{}", rest), "c: fn is no function: \"fresnell\""},
        {"missing", case_with("fresnel", R"({"cos_i": 1})", rest), "c: in.eta is missing"},
        {"text", case_with("fresnel", R"({"cos_i": "1", "eta": 1.5})", rest),
         "c: in.cos_i is not a number"},
        {"range", case_with("fresnel", R"({"cos_i": 2, "eta": 1.5})", rest),
         "c: in.cos_i is not within 0.0 and 1.0"},
        {"null", case_with("hg", R"({"cos_j": 0, "g": null})", rest), "c: in.g is not a number"},
        {"phase", case_with("hg", R"({"cos_j": 0, "g": 1})", rest),
         "c: in.g is not between -1 and 1"},
        {"nothing", case_with("dipole_total", R"({"sigma_s": 0, "sigma_a": 0, "eta": 1.5})", rest),
         "c: in.sigma_s is 0, and so is sigma_a"},
        {"distance", case_with("dipole_rd", "{" + scattering + R"(, "r": -1})", rest),
         "c: in.r is not within"},
        {"vector", case_with("frame", R"({"n": [0, 1]})", rest),
         "c: in.n is not a list of 3 numbers"},
        {"length", case_with("frame", R"({"n": [0, 2, 0]})", rest), "c: in.n is not of length 1"},
        {"in", case_with("frame", "7", rest), "c: in is not an object"},
        {"out", case_with("frame", R"({"n": [0, 0, 1]})", R"("rtol": 0, "atol": 0)"),
         "c: out is missing"},
        {"kind", case_with("frame", R"({"n": [0, 0, 1]})", rest),
         "c: out is a number, where the function gives none"},
        {"value",
         case_with("fresnel", R"({"cos_i": 1, "eta": 1.5})",
                   R"("out": {"F": 0.04}, "rtol": 0, "atol": 0)"),
         "c: out is an object, where the function gives none"},
        {"unknown",
         case_with("frame", R"({"n": [0, 0, 1]})", R"("out": {"z": 1}, "rtol": 0, "atol": 0)"),
         "c: out.z is not of the function"},
        {"list",
         case_with("frame", R"({"n": [0, 0, 1]})", R"("out": {"t": [1]}, "rtol": 0, "atol": 0)"),
         "c: out.t has another length"},
        {"tolerance",
         case_with("fresnel", R"({"cos_i": 1, "eta": 1.5})",
                   R"("out": 0.04, "rtol": -1, "atol": 0)"),
         "c: rtol is not within"},
        {"query",
         case_with("highlight_field",
                   R"({"field": {"n": 4, "dx": 1, "amp": 0, "kx": 0, "ky": 0, "slope": 0},
                       "light_deg": [40, 0], "w_o": [0, 0, 1], "sigma": 1, "model": "ward",
                       "n_t": 2, "n_b": 2, "query": [4, 0]})",
                   rest),
         "c: in.query is not a point of the field"},
        {"id", R"({"fn": "hg"})", "case 0: id is missing"},
        {"case", "3", "case 0: all of it is not an object"},
    };
    for (const Broken& one : broken) {
        SCOPED_TRACE(one.name);
        const Verdict verdict_on = verdict(file_of(one.cases));
        EXPECT_EQ(verdict_on.status, 2) << verdict_on.out;
        EXPECT_TRUE(verdict_on.err.starts_with(one.message)) << verdict_on.err;
        EXPECT_NE(verdict_on.out.find("1 cannot be judged"), std::string::npos) << verdict_on.out;
    }
}

TEST(Judge, JudgesTheOtherCasesOfABadFileToo) {
    const Verdict mixed =
        verdict(file_of(R"({"id": "x", "fn": "?", "in": {}},)" + std::string(wrong)));
    EXPECT_EQ(mixed.status, 2);
    EXPECT_NE(mixed.out.find("wrong differs"), std::string::npos) << mixed.out;
}

TEST(Judge, RefusesFilesThatAreNone) {
    for (const char* text :
         {"", "{", "[]", "null", R"({"cases": []})", R"({"format": "other", "cases": []})",
          R"({"format": "translucency-reference/1"})",
          R"({"format": "translucency-reference/1", "cases": {}})",
          R"({"format": "translucency-reference/1", "cases": [1e999]})"}) {
        const Verdict none = verdict(text);
        EXPECT_EQ(none.status, 2) << text;
        EXPECT_FALSE(none.err.empty()) << text;
    }
    EXPECT_EQ(verdict(file_of("")).status, 2);  // nothing was shown
}

int status_of(const std::string& arguments) {
    const int status =
        std::system(("'" RELIT_REFERENCE_PATH "' " + arguments + " >/dev/null 2>&1").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST(RelitReference, TakesOneFileThatCanBeRead) {
    EXPECT_EQ(status_of("'" RELIT_SOURCE_DIR "/tests/reference/translucency-reference.json'"), 0);
    EXPECT_EQ(status_of(""), 2);
    EXPECT_EQ(status_of("no-such-file.json"), 2);
    EXPECT_EQ(status_of("'" RELIT_SOURCE_DIR "/tests'"), 2);
    EXPECT_EQ(status_of("'" RELIT_SOURCE_DIR "/tests/reference/README.md'"), 2);
}

}  // namespace
}  // namespace relit::test::reference
