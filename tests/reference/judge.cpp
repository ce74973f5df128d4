#include "tests/reference/judge.h"

#include <cmath>
#include <iomanip>
#include <ostream>
#include <sstream>

#include "tests/reference/cases.h"

namespace relit::test::reference {
namespace {

constexpr const char* format = "translucency-reference/1";

struct Tolerance {
    double relative = 0;
    double absolute = 0;
};

struct Count {
    int agree = 0;
    int differ = 0;
    int bad = 0;
};

std::string digits(double number) {
    std::ostringstream text;
    text << std::setprecision(12) << number;
    return text.str();
}

// What differs between a case's "out" and what was computed, in words: the first number of it.
class Comparison {
public:
    explicit Comparison(Tolerance tolerance) : tolerance_(tolerance) {}

    void compare(const std::string& path, const Json& expected, const Json& got) {
        if (expected.is_number()) compare_numbers(path, expected.get<double>(), got);
        else if (expected.is_array()) compare_lists(path, expected, got);
        else if (expected.is_object()) compare_objects(path, expected, got);
        else throw BadCase(path, "is not a number, a list or an object");
    }

    /// Empty when all agrees.
    [[nodiscard]] const std::string& difference() const { return difference_; }

private:
    void compare_numbers(const std::string& path, double expected, const Json& got) {
        if (!got.is_number()) throw BadCase(path, "is a number, where the function gives none");
        const double value = got.get<double>();
        const double allowed = tolerance_.absolute + tolerance_.relative * std::abs(expected);
        if (std::abs(value - expected) <= allowed || !difference_.empty()) return;  // NaN differs
        difference_ = path + ": expected " + digits(expected) + ", got " + digits(value) +
                      ", tolerance " + digits(allowed);
    }

    void compare_lists(const std::string& path, const Json& expected, const Json& got) {
        if (!got.is_array() || got.size() != expected.size())
            throw BadCase(path, "has another length than the function's list");
        for (std::size_t i = 0; i < expected.size(); ++i)
            compare(path + '[' + std::to_string(i) + ']', expected[i], got[i]);
    }

    void compare_objects(const std::string& path, const Json& expected, const Json& got) {
        if (!got.is_object()) throw BadCase(path, "is an object, where the function gives none");
        for (const auto& [name, value] : expected.items()) {
            if (name == "octree") continue;  // errors of another tree, no values of the function
            if (!got.contains(name)) throw BadCase(below(path, name), "is not of the function");
            compare(below(path, name), value, got.at(name));
        }
    }

    Tolerance tolerance_;
    std::string difference_;
};

std::string difference_of(const Json& one) {
    const Fields fields("", one);
    const Json computed = evaluated(fields.text("fn"), fields.object("in"));
    Comparison comparison({fields.number("rtol", 0, 1), fields.number("atol", 0, 1e9)});
    comparison.compare("out", fields.at("out"), computed);
    return comparison.difference();
}

void judge_case(const Json& one, std::size_t index, Count& count, std::ostream& out,
                std::ostream& err) {
    std::string id = "case " + std::to_string(index);  // until it is known
    try {
        id = Fields("", one).text("id");
        const std::string difference = difference_of(one);
        ++(difference.empty() ? count.agree : count.differ);
        out << id << (difference.empty() ? " ok" : " differs: " + difference) << '\n';
    } catch (const BadCase& bad) {
        ++count.bad;
        err << id << ": " << bad.what() << '\n';
    }
}

}  // namespace

int judge(std::string_view json, std::ostream& out, std::ostream& err) {
    Json file;
    try {
        file = Json::parse(json);
        const Fields fields("", file);
        if (fields.text("format") != format)
            fields.refuse("format", std::string("is not \"") + format + '"');
        if (!fields.at("cases").is_array()) fields.refuse("cases", "is not a list");
    } catch (const Json::exception& broken) {
        err << broken.what() << '\n';
        return 2;
    } catch (const BadCase& bad) {
        err << bad.what() << '\n';
        return 2;
    }
    Count count;
    for (std::size_t i = 0; i < file["cases"].size(); ++i)
        judge_case(file["cases"][i], i, count, out, err);
    out << count.agree << " agree, " << count.differ << " differ, " << count.bad
        << " cannot be judged\n";
    if (count.bad > 0 || file["cases"].empty()) return 2;
    return count.differ > 0 ? 1 : 0;
}

}  // namespace relit::test::reference
