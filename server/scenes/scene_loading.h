// SceneDescription -> Scene: the images that a description names, found, decoded, checked and given
// their meaning. For everything that renders described scenes, over HTTP or not. Source: api.md, "A
// scene".
#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <string_view>

#include "core/base/shared_cache.h"
#include "core/io/decode.h"
#include "core/render/scene.h"
#include "server/limits.h"
#include "server/schema/description.h"
#include "server/shared_bytes.h"

namespace relit::server {

/// The bytes of an image. @throws Error not_found
using FindImage = std::function<SharedBytes(const ImageSource&)>;

/// The image in a file's bytes, as relit::decode() makes it. @throws Error as that does
using DecodeImage = std::function<DecodedImage(std::string_view bytes)>;

/// Loads what `description` names; what `cache` has of it is not decoded again, but found all the
/// same, so that an image that is gone is gone at once. Afterwards the scene and `description.output.picture` meet
/// render()'s preconditions.
///
/// @throws Error what `find` and `decode` throw; image_too_large (an environment); too_costly; invalid_value for a region or a size that the map does not allow. `pointer` names the
///         field
[[nodiscard]] Scene load_scene(const SceneDescription& description, const FindImage& find,
                               const DecodeImage& decode, const Limits& limits,
                               const Executor& executor, SharedCache& cache);

/// Whether a picture can be made of a map of that size; load_scene() checks it too.
/// @throws Error invalid_value; `pointer` names the field
void check_output(const OutputDescription& output, int map_width, int map_height,
                  const Limits& limits);

/// The picture that render() is to make for the file that is asked for.
[[nodiscard]] Output picture_output(const OutputDescription& output);

/// How that file is to be written.
/// @param scene_text  the scene's JSON, kept in formats that can hold it
[[nodiscard]] EncodeOptions encode_options(const OutputDescription& output, std::string scene_text);

}  // namespace relit::server
