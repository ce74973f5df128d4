// A reference file held against what core/scatter computes. Format: specification "translucency",
// section 8.
#pragma once

#include <iosfwd>
#include <string_view>

namespace relit::test::reference {

/// A line per case and a closing count on `out`; what is wrong with the file itself on `err`, by
/// case and field.
/// @return 0 when every case agrees, 1 when one differs, 2 when the file or a case of it cannot be
///         judged (the other cases are, all the same)
[[nodiscard]] int judge(std::string_view json, std::ostream& out, std::ostream& err);

}  // namespace relit::test::reference
