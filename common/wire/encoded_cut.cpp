#include "common/wire/encoded_cut.hpp"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/wire_format_lite.h>

#include "common/wire/convert.hpp"

namespace osteon::wire {

std::shared_ptr<const std::string> encoded(const Cut& cut) {
  return std::make_shared<const std::string>(to_wire(cut).SerializeAsString());
}

void append_field(std::string& message, int number, std::string_view content) {
  using Format = google::protobuf::internal::WireFormatLite;
  google::protobuf::io::StringOutputStream stream(&message);
  google::protobuf::io::CodedOutputStream out(&stream);
  out.WriteTag(Format::MakeTag(number, Format::WIRETYPE_LENGTH_DELIMITED));
  out.WriteVarint32(static_cast<std::uint32_t>(content.size()));
  out.WriteRaw(content.data(), static_cast<int>(content.size()));
}

}  // namespace osteon::wire
