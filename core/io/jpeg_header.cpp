// JPEG markers (ITU-T T.81, annex B): the frame's size and process, and the file without its
// application segments.
#include <cstring>

#include "core/io/byte_reader.h"
#include "core/io/header.h"

namespace relit {
namespace {

// A scan of a few bytes makes the decoder walk over the whole picture; real files have about ten.
constexpr int max_scans = 100;

bool is_frame(int marker) {
    return marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
}

// APP0 (JFIF) and APP14 (Adobe) say which colours the numbers are; the other APPs and COM are
// metadata.
bool is_metadata(int marker) {
    return (marker >= 0xe1 && marker <= 0xef && marker != 0xee) || marker == 0xfe;
}

// Entropy-coded bytes hold 0xff only as ff 00 (a stuffed byte) and ff d0..d7 (restart markers).
std::string_view entropy_coded(std::string_view bytes) {
    std::size_t at = 0;
    while (at + 1 < bytes.size()) {
        const void* found = std::memchr(bytes.data() + at, 0xff, bytes.size() - 1 - at);
        if (!found) break;
        at = std::size_t(static_cast<const char*>(found) - bytes.data());
        const auto next = static_cast<unsigned char>(bytes[at + 1]);
        if (next != 0 && (next < 0xd0 || next > 0xd7) && next != 0xff) return bytes.substr(0, at);
        at += next == 0xff ? 1 : 2;
    }
    return bytes;
}

struct Segment {
    int marker = 0;
    std::string_view data;  // without the length
};

Segment next_segment(ByteReader& reader) {
    // Anything between segments is skipped, as decoders do.
    while (reader.u8() != 0xff) {
    }
    Segment segment;
    while ((segment.marker = reader.u8()) == 0xff) {
    }
    const bool alone = segment.marker == 0x01 || segment.marker == 0 ||
                       (segment.marker >= 0xd0 && segment.marker <= 0xd9);
    if (alone) return segment;
    const int length = reader.u16();
    if (length < 2) throw_broken(FileFormat::jpeg, "a segment of it has no length");
    segment.data = reader.take(std::uint64_t(length) - 2);
    return segment;
}

void append(std::string& out, const Segment& segment) {
    out += '\xff';
    out += char(segment.marker);
    if (segment.marker >= 0xd0 && segment.marker <= 0xd9) return;
    const std::size_t length = segment.data.size() + 2;
    out += char(length >> 8);
    out += char(length & 0xff);
    out += segment.data;
}

struct Frame {
    int marker = 0;
    int components = 0;
};

void read_frame(const Segment& segment, Frame& frame, FileHeader& header) {
    if (frame.marker != 0) throw_broken(FileFormat::jpeg, "it has two frames");
    ByteReader reader(segment.data, FileFormat::jpeg, std::endian::big);
    frame.marker = segment.marker;
    const int precision = reader.u8();
    header.height = reader.u16();
    header.width = reader.u16();
    frame.components = reader.u8();
    header.channels = frame.components;
    if (precision != 8) throw_unsupported(FileFormat::jpeg, "more than 8 bits");
    if (frame.components == 4) throw_unsupported(FileFormat::jpeg, "CMYK colour");
    if (frame.components != 1 && frame.components != 3)
        throw_unsupported(FileFormat::jpeg, "neither 1 nor 3 channels");
}

}  // namespace

FileHeader read_jpeg_header(std::string_view bytes) {
    ByteReader reader(bytes, FileFormat::jpeg, std::endian::big);
    FileHeader header;
    header.stripped = reader.take(2);
    Frame frame;
    int scans = 0;
    while (true) {
        if (scans > 0 && reader.remaining() < 2)
            break;  // without its end marker: the decoder decides
        const Segment segment = next_segment(reader);
        if (segment.marker == 0 || segment.marker == 0x01 || is_metadata(segment.marker)) continue;
        append(header.stripped, segment);
        if (segment.marker == 0xd9) break;
        if (is_frame(segment.marker)) read_frame(segment, frame, header);
        if (segment.marker != 0xda) continue;
        if (frame.marker == 0 || segment.data.empty())
            throw_broken(FileFormat::jpeg, "its texels come before its size");
        if (++scans > max_scans)
            throw_unsupported(FileFormat::jpeg,
                              "more than " + std::to_string(max_scans) + " scans");
        // Several scans: the decoder keeps the coefficients of all of them.
        header.held_whole |= frame.marker != 0xc0 && frame.marker != 0xc1 && frame.marker != 0xc9;
        header.held_whole |= segment.data[0] != frame.components;
        const std::string_view scan = entropy_coded(bytes.substr(reader.position()));
        header.stripped += scan;
        reader.seek(reader.position() + scan.size());
    }
    if (scans == 0) throw_broken(FileFormat::jpeg, "it has no texels");
    return header;
}

}  // namespace relit
