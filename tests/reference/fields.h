// Fields of a reference file's cases, read with what may be wrong told by name. For the functions
// of cases.h.
#pragma once

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/base/vec.h"
#include "core/scatter/medium.h"

namespace relit::test::reference {

using Json = nlohmann::json;

/// "path.name"; "name" below the empty path.
[[nodiscard]] std::string below(const std::string& path, const std::string& name);

/// A case that cannot be judged: what() names the field.
struct BadCase : std::runtime_error {
    BadCase(const std::string& field, const std::string& what)
        : std::runtime_error(field + ' ' + what) {}
};

/// An object of a case: the case itself (path ""), "in", "in.field".
class Fields {
public:
    /// @param object  refers to what outlives this
    Fields(std::string path, const Json& object);

    [[nodiscard]] double number(const std::string& name) const;
    [[nodiscard]] double number_or(const std::string& name, double otherwise) const;
    /// Within [least, most].
    [[nodiscard]] double number(const std::string& name, double least, double most) const;
    [[nodiscard]] double positive(const std::string& name) const;
    [[nodiscard]] int integer(const std::string& name, int least, int most) const;
    [[nodiscard]] std::string text(const std::string& name) const;
    [[nodiscard]] Vec3 vector(const std::string& name) const;
    [[nodiscard]] Vec3 unit_vector(const std::string& name) const;  ///< within 1e-6
    [[nodiscard]] const Json& at(const std::string& name) const;
    [[nodiscard]] Fields object(const std::string& name) const;
    [[nodiscard]] std::vector<double> numbers(const std::string& name, std::size_t count) const;
    /// Of `count` numbers each.
    [[nodiscard]] std::vector<std::vector<double>> rows(const std::string& name,
                                                        std::size_t count) const;

    /// sigma_s, sigma_a, g and eta, as Coefficients takes them.
    [[nodiscard]] scatter::Coefficients coefficients() const;

    [[noreturn]] void refuse(const std::string& name, const std::string& why) const;

private:
    [[nodiscard]] std::vector<double> list(const Json& value, const std::string& name,
                                           std::size_t count) const;

    std::string path_;
    const Json* object_;
};

}  // namespace relit::test::reference
