#include "server/schema/capabilities_json.h"

#include "server/schema/fields.h"
#include "server/schema/presets.h"
#include "server/schema/writer.h"

namespace relit::server {
namespace {

OrderedJson read_formats() {
    OrderedJson list = OrderedJson::array();
    for (const FileFormat format : {FileFormat::png, FileFormat::jpeg, FileFormat::webp,
                                    FileFormat::tiff, FileFormat::exr, FileFormat::hdr})
        list.push_back({{"format", name_of(format)}, {"mediaType", media_type_of(format)}});
    return list;
}

OrderedJson written_formats() {
    OrderedJson list = OrderedJson::array();
    for (const auto& [name, format] : choices_of<PictureFormat>())
        list.push_back({{"format", name},
                        {"mediaType", media_type_of(format)},
                        {"bitDepths", bit_depths_of(format)},
                        {"maxSide", max_side_of(format)}});
    return list;
}

OrderedJson layers() {
    OrderedJson list = OrderedJson::array();
    for (const auto& layer : choices_of<Layer>()) list.push_back(layer.name);
    return list;
}

OrderedJson preset_names() {
    OrderedJson list = OrderedJson::array();
    for (const PresetInfo& preset : preset_list()) list.push_back(preset.name);
    return list;
}

OrderedJson limits_of(const Limits& limits) {
    return {
        {"maxImageBytes", limits.max_image_bytes},
        {"maxBodyBytes", limits.max_body_bytes},
        {"maxUriBytes", limits.max_uri_bytes},
        {"maxHeadBytes", limits.max_head_bytes},
        {"maxHeaders", limits.max_headers},
        {"maxParts", limits.max_parts},
        {"maxPartHeadBytes", limits.max_part_head_bytes},
        {"maxImagePixels", limits.max_image_pixels},
        {"maxImageSide", decode_limits(limits).max_side},
        {"maxImageChannels", limits.max_image_channels},
        {"maxImageValues", limits.max_image_values},
        {"maxTileBytes", limits.max_tile_bytes},
        {"maxInterlacedPixels", limits.max_interlaced_pixels},
        {"maxEnvironmentPixels", limits.max_environment_pixels},
        {"maxOutputPixels", limits.max_output_pixels},
        {"maxLights", limits.max_lights},
        {"maxSceneCost", limits.max_scene_cost},
        {"maxRenderMemory", limits.max_render_memory_bytes},
        {"maxJsonDepth", limits.json.max_depth},
        {"maxJsonValues", limits.json.max_values},
        {"maxDecodeMemory", limits.max_decode_memory_bytes},
        {"decodeTimeout", limits.decode_timeout.count()},
        {"maxBatchBytes", limits.max_batch_bytes},
        {"maxBatchFrames", limits.max_batch_frames},
        {"maxUnfinishedBatches", limits.max_unfinished_batches},
        {"maxResults", limits.max_result_bytes},
        {"batchExpiry", limits.batch_expiry.count()},
        {"batchFrameTimeout", limits.batch_frame_timeout.count()},
        {"maxStreams", limits.streams_at_once()},
        {"maxConnections", limits.max_connections},
        {"maxWaitingConnections", limits.max_waiting_connections},
        {"maxAddressConnections", limits.max_address_connections},
        {"maxQueue", limits.max_queue},
        {"rateLimit", limits.rate_limit},
        {"rateBurst", limits.rate_burst},
        {"renderTimeout", limits.render_timeout.count()},
        {"idleTimeout", limits.idle_timeout.count()},
        {"transferTimeout", limits.transfer_timeout.count()},
    };
}

}  // namespace

std::string capabilities_json(std::string_view version, const Limits& limits) {
    return OrderedJson{
        {"name", "relit"},
        {"version", version},
        {"formats", {{"read", read_formats()}, {"write", written_formats()}}},
        {"layers", layers()},
        {"presets", preset_names()},
        {"limits", limits_of(limits)},
    }
        .dump();
}

}  // namespace relit::server
