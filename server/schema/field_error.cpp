#include "server/schema/field_error.h"

#include <algorithm>

#include "core/base/error.h"

namespace relit::server {

std::string field_name(std::string_view pointer) {
    if (pointer.empty()) return "the scene";
    std::string name(pointer.substr(1));
    std::replace(name.begin(), name.end(), '/', '.');
    return "'" + name + "'";
}

void refuse_value(const std::string& detail, const std::string& pointer, std::string_view limit) {
    throw Error(error_code::invalid_value, field_name(pointer) + " " + detail, pointer, limit);
}

}  // namespace relit::server
