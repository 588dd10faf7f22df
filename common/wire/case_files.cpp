#include "common/wire/case_files.hpp"

#include <grpcpp/grpcpp.h>

#include <chrono>
#include <fstream>
#include <optional>
#include <string>

#include "common/wire/convert.hpp"
#include "osteon/v1/room.grpc.pb.h"

namespace osteon::wire {
namespace {

constexpr std::chrono::seconds kLongestFetch{60};  // a whole case takes no longer on one machine

}  // namespace

Result<void> fetch_case_files(const JoinedRoom& room, const std::filesystem::path& folder,
                              const FetchControl& control) {
  v1::GetCaseRequest request;
  request.set_case_hash(to_wire(room.case_hash));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kLongestFetch);
  const Error stopped{ErrorCode::cancelled, "stopped while the case was fetched"};
  if (control.begin && !control.begin(context)) return tl::unexpected(stopped);
  const auto reader = v1::RoomService::NewStub(room.channel)->GetCase(&context, request);

  // A correct server sends these names and no others.
  std::optional<Error> failed;
  std::string open_name;
  std::ofstream file;
  v1::GetCaseResponse piece;
  while (!failed && reader->Read(&piece)) {
    if (control.stop && control.stop()) {
      failed = stopped;
    } else if (piece.file() != "case.json" && piece.file() != "bone.vdb") {
      failed = Error{ErrorCode::unsupported, "the server sent a file that no case has: " + piece.file()};
    } else {
      if (piece.file() != open_name) {
        file.close();
        file.clear();
        file.open(folder / piece.file(), std::ios::binary | std::ios::trunc);
        open_name = piece.file();
      }
      file.write(piece.data().data(), static_cast<std::streamsize>(piece.data().size()));
      file.flush();
      if (!file)
        failed = Error{ErrorCode::internal, "cannot store the case in the cache: " + (folder / open_name).string() +
                                                ": it cannot be written (is the disk full?)"};
    }
  }
  if (failed) context.TryCancel();
  const grpc::Status status = reader->Finish();
  if (control.end) control.end(context);
  if (failed) return tl::unexpected(*failed);
  if (!status.ok())
    return failure(ErrorCode::unavailable, "the server stopped sending the case: " + status.error_message());
  return {};
}

}  // namespace osteon::wire
