#include "tests/reference/fields.h"

#include <cmath>

namespace relit::test::reference {

std::string below(const std::string& path, const std::string& name) {
    return path.empty() ? name : path + '.' + name;
}

Fields::Fields(std::string path, const Json& object) : path_(std::move(path)), object_(&object) {
    if (!object.is_object()) throw BadCase(path_.empty() ? "all of it" : path_, "is not an object");
}

void Fields::refuse(const std::string& name, const std::string& why) const {
    throw BadCase(below(path_, name), why);
}

const Json& Fields::at(const std::string& name) const {
    const auto found = object_->find(name);
    if (found == object_->end()) refuse(name, "is missing");
    return *found;
}

double Fields::number(const std::string& name) const {
    const Json& value = at(name);
    if (!value.is_number()) refuse(name, "is not a number");
    return value.get<double>();
}

double Fields::number_or(const std::string& name, double otherwise) const {
    return object_->contains(name) ? number(name) : otherwise;
}

double Fields::number(const std::string& name, double least, double most) const {
    const double value = number(name);
    if (!(value >= least && value <= most))
        refuse(name, "is not within " + Json(least).dump() + " and " + Json(most).dump());
    return value;
}

double Fields::positive(const std::string& name) const {
    const double value = number(name);
    if (!(value > 0)) refuse(name, "is not above 0");
    return value;
}

int Fields::integer(const std::string& name, int least, int most) const {
    const double value = number(name, least, most);
    if (value != std::floor(value)) refuse(name, "is not a whole number");
    return int(value);
}

std::string Fields::text(const std::string& name) const {
    const Json& value = at(name);
    if (!value.is_string()) refuse(name, "is not a string");
    return value.get<std::string>();
}

std::vector<double> Fields::list(const Json& value, const std::string& name,
                                 std::size_t count) const {
    const std::string why = "is not a list of " + std::to_string(count) + " numbers";
    if (!value.is_array() || value.size() != count) refuse(name, why);
    std::vector<double> all;
    for (const Json& entry : value) {
        if (!entry.is_number()) refuse(name, why);
        all.push_back(entry.get<double>());
    }
    return all;
}

std::vector<double> Fields::numbers(const std::string& name, std::size_t count) const {
    return list(at(name), name, count);
}

Vec3 Fields::vector(const std::string& name) const {
    const auto v = numbers(name, 3);
    return {v[0], v[1], v[2]};
}

Vec3 Fields::unit_vector(const std::string& name) const {
    const Vec3 v = vector(name);
    if (!(std::abs(length(v) - 1) <= 1e-6)) refuse(name, "is not of length 1");
    return v;
}

Fields Fields::object(const std::string& name) const { return {below(path_, name), at(name)}; }

std::vector<std::vector<double>> Fields::rows(const std::string& name, std::size_t count) const {
    const Json& value = at(name);
    if (!value.is_array()) refuse(name, "is not a list");
    std::vector<std::vector<double>> all;
    for (std::size_t i = 0; i < value.size(); ++i)
        all.push_back(list(value[i], name + '[' + std::to_string(i) + ']', count));
    return all;
}

scatter::Coefficients Fields::coefficients() const {
    scatter::Coefficients c;
    c.sigma_a = number("sigma_a", 0, 1e9);
    c.sigma_s = number("sigma_s", 0, 1e9);
    c.g = number_or("g", 0);
    c.eta = number("eta", 1, 10);
    if (!(std::abs(c.g) < 1)) refuse("g", "is not between -1 and 1");
    if (!(c.sigma_a + c.sigma_s > 0)) refuse("sigma_s", "is 0, and so is sigma_a");
    return c;
}

}  // namespace relit::test::reference
