#include "tests/scenario/recording.hpp"

#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <google/protobuf/util/delimited_message_util.h>

#include <fstream>
#include <sstream>

#include "common/runtime/files.hpp"
#include "common/wire/convert.hpp"
#include "tests/support/scenes/bones.hpp"

namespace osteon::test {
namespace {

std::filesystem::path with(std::filesystem::path stem, const char* extension) { return stem += extension; }

}  // namespace

Case recorded_bone() { return plain_block(20.0, 5.0, 0.5); }

Result<Recording> read_recording(const std::filesystem::path& stem) {
  const auto hash_text = read_file(with(stem, ".hash"));
  if (!hash_text) return tl::unexpected(hash_text.error());
  const auto hash = digest_from_hex(hash_text->substr(0, hash_text->find('\n')));
  if (!hash) return tl::unexpected(hash.error());
  Recording recording{{}, *hash};

  std::ifstream in(with(stem, ".cuts"), std::ios::binary);
  google::protobuf::io::IstreamInputStream stream(&in);
  for (bool at_end = false; !at_end;) {
    v1::Cut message;
    if (!google::protobuf::util::ParseDelimitedFromZeroCopyStream(&message, &stream, &at_end)) {
      if (at_end) break;
      return failure(ErrorCode::invalid_input,
                     with(stem, ".cuts").string() + " is damaged; make it again with osteon-record-scenarios");
    }
    const auto cut = wire::from_wire(message);
    if (!cut) return failure(ErrorCode::invalid_input, with(stem, ".cuts").string() + ": " + cut.error().message);
    recording.cuts.push_back(*cut);
  }
  return recording;
}

Result<void> write_recording(const std::filesystem::path& stem, const Recording& recording) {
  std::ostringstream out;
  for (const Cut& cut : recording.cuts) google::protobuf::util::SerializeDelimitedToOstream(wire::to_wire(cut), &out);
  if (auto written = write_file(with(stem, ".cuts"), out.str()); !written) return written;
  return write_file(with(stem, ".hash"), to_hex(recording.field_hash) + "\n");
}

}  // namespace osteon::test
