// OpenImageIO as Relit uses it: one set of global settings, made once.
#pragma once

namespace relit {

/// Every reader and writer runs on the thread that calls it: no pool is started behind the server's
/// back, output does not depend on one, and two of the reader's known bugs need one. Cheap after
/// the first call; safe from any thread.
void configure_openimageio();

}  // namespace relit
