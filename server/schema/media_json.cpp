#include "server/schema/media_json.h"

#include "core/scatter/dipole.h"
#include "server/schema/fields.h"
#include "server/schema/writer.h"

namespace relit::server {
namespace {

// A number of each colour.
template <class Of>
OrderedJson per_colour(const Of& of) {
    return OrderedJson::array({of(0), of(1), of(2)});
}

OrderedJson described_medium(const scatter::NamedMedium& named) {
    const auto colour = [&](int c) { return scatter::channel(named.medium, c); };
    const auto follows = [&](int c) { return scatter::derived(colour(c)); };
    Writer numbers;
    medium_fields(numbers, named.medium);
    return {
        {"name", named.name},
        {"title", named.title},
        {"source", named.source},
        {"medium", std::move(numbers.json)},
        {"albedo", per_colour([&](int c) { return scatter::StandardDipole(colour(c)).total(); })},
        {"freePath", per_colour([&](int c) { return follows(c).free_path; })},
        {"reach", per_colour([&](int c) { return 1 / follows(c).sigma_tr; })}};
}

}  // namespace

std::string media_json() {
    OrderedJson list = OrderedJson::array();
    for (const scatter::NamedMedium& named : scatter::measured_media())
        list.push_back(described_medium(named));
    return OrderedJson{{"media", std::move(list)}}.dump();
}

}  // namespace relit::server
