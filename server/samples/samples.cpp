#include "server/samples/samples.h"

#include "embedded/samples.h"
#include "server/storage/sha256.h"

namespace relit::server {
namespace {

Sample sample(Sample sample) {
    sample.id = sha256_hex(sample.bytes);
    if (sample.kind == "environment")
        sample.scene =
            R"({"light":{"type":"environment","image":{"image":")" + sample.id + R"("}}})";
    return sample;
}

std::vector<Sample> all_samples() {
    namespace files = embedded::samples;
    constexpr std::string_view public_domain = "Public domain";
    constexpr std::string_view cc0 = "CC0 1.0";
    std::vector<Sample> all;
    all.push_back(sample({
        .name = "plato",
        .title = "Bust of Plato, scan of a marble",
        .kind = "relief",
        .credit = "Three D Scans (Oliver Laric), by way of keijiro/ThreeDScans",
        .licence = "No copyright restrictions",
        .source = "https://threedscans.com",
        .scene = R"({"preset":"marble"})",
        .bytes = files::plato_png(),
    }));
    all.push_back(sample({
        .name = "head",
        .title = "Head and shoulders of a man, scan",
        .kind = "relief",
        .credit = "\"Infinite, 3D Head Scan\" by Lee Perry-Smith, by way of "
                  "BabylonJS/MeshesLibrary; rendered as a height map",
        .licence = "CC BY 3.0",
        .source = "https://creativecommons.org/licenses/by/3.0/",
        .scene = R"({"preset":"skin"})",
        .bytes = files::head_png(),
    }));
    all.push_back(sample({
        .name = "fish",
        .title = "Grey snapper, modelled",
        .kind = "relief",
        .credit = "Babylon.js contributors, BabylonJS/MeshesLibrary; rendered as a height map",
        .licence = "CC BY 4.0",
        .source = "https://creativecommons.org/licenses/by/4.0/",
        .scene = R"({"preset":"jade"})",
        .bytes = files::fish_png(),
    }));
    all.push_back(sample({
        .name = "st-helens",
        .title = "Mount St. Helens after the eruption of 1980, metres",
        .kind = "relief",
        .credit = "US Geological Survey",
        .licence = public_domain,
        .source = "https://www.usgs.gov",
        .scene = R"({"preset":"sunset"})",
        .bytes = files::st_helens_tif(),
    }));
    all.push_back(sample({
        .name = "venice-sunset",
        .title = "Venice, a low sun over water",
        .kind = "environment",
        .credit = "Poly Haven, venice_sunset",
        .licence = cc0,
        .source = "https://polyhaven.com/a/venice_sunset",
        .bytes = files::venice_sunset_hdr(),
    }));
    all.push_back(sample({
        .name = "rainbow",
        .title = "All hues round the horizon, computed",
        .kind = "environment",
        .credit = "made for tests of relighting",
        .licence = cc0,
        .bytes = files::rainbow_hdr(),
    }));
    return all;
}

}  // namespace

const std::vector<Sample>& samples() {
    static const std::vector<Sample> all = all_samples();
    return all;
}

const Sample* find_sample(std::string_view id_or_name) {
    for (const Sample& sample : samples())
        if (sample.id == id_or_name || sample.name == id_or_name) return &sample;
    return nullptr;
}

}  // namespace relit::server
