// The functions that reference files name, each computed by core/scatter. For relit_reference.
#pragma once

#include <string>

#include "tests/reference/fields.h"

namespace relit::test::reference {

/// What function `fn` gives for the fields of "in": a number, or an object of numbers and lists.
/// Throws BadCase when there is no such function, or a field is missing or out of its range.
[[nodiscard]] Json evaluated(const std::string& fn, const Fields& in);

}  // namespace relit::test::reference
