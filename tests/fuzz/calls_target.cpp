#include "tests/fuzz/calls_target.hpp"

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <array>
#include <chrono>
#include <memory>
#include <string>
#include <utility>

#include "common/core/check.hpp"
#include "osteon/v1/cases.grpc.pb.h"
#include "osteon/v1/cutting.grpc.pb.h"
#include "osteon/v1/people.grpc.pb.h"
#include "osteon/v1/room.grpc.pb.h"
#include "osteon/v1/rooms.grpc.pb.h"
#include "osteon/v1/watch.grpc.pb.h"
#include "server/net/room_server.hpp"
#include "tests/support/scenes/bones.hpp"
#include "tests/support/temp_dir.hpp"

namespace osteon::fuzz {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;

constexpr const char* kRoom = "room";
constexpr std::size_t kMostRooms = 3;

std::vector<const MethodDescriptor*> methods() {
  std::vector<const MethodDescriptor*> all;
  for (const google::protobuf::FileDescriptor* file :
       {v1::GetStatusRequest::descriptor()->file(), v1::SessionRequest::descriptor()->file(), v1::WatchMeshRequest::descriptor()->file(),
        v1::ListRoomsRequest::descriptor()->file(), v1::SayRequest::descriptor()->file(), v1::UploadCaseRequest::descriptor()->file()})
    for (int s = 0; s < file->service_count(); ++s)
      for (int m = 0; m < file->service(s)->method_count(); ++m) all.push_back(file->service(s)->method(m));
  return all;
}

// A request with everything in it that there is: whose values are sound as far as their types say what is.
void fill(Message& message, int depth = 0) {
  const google::protobuf::Reflection& reflect = *message.GetReflection();
  for (int i = 0; i < message.GetDescriptor()->field_count(); ++i) {
    const FieldDescriptor* field = message.GetDescriptor()->field(i);
    const bool many = field->is_repeated();
    switch (field->cpp_type()) {
      case FieldDescriptor::CPPTYPE_MESSAGE:
        if (depth < 4) fill(many ? *reflect.AddMessage(&message, field) : *reflect.MutableMessage(&message, field), depth + 1);
        break;
      case FieldDescriptor::CPPTYPE_STRING: {
        const std::string text = field->type() == FieldDescriptor::TYPE_BYTES ? std::string(32, '\1') : "room";
        many ? reflect.AddString(&message, field, text) : reflect.SetString(&message, field, text);
        break;
      }
      case FieldDescriptor::CPPTYPE_UINT64: many ? reflect.AddUInt64(&message, field, 1) : reflect.SetUInt64(&message, field, 1); break;
      case FieldDescriptor::CPPTYPE_UINT32: many ? reflect.AddUInt32(&message, field, 1) : reflect.SetUInt32(&message, field, 1); break;
      case FieldDescriptor::CPPTYPE_INT32:
        for (int k = 0; k < (many ? 3 : 1); ++k) many ? reflect.AddInt32(&message, field, 1) : reflect.SetInt32(&message, field, 1);
        break;
      case FieldDescriptor::CPPTYPE_INT64: many ? reflect.AddInt64(&message, field, 1) : reflect.SetInt64(&message, field, 1); break;
      case FieldDescriptor::CPPTYPE_DOUBLE: many ? reflect.AddDouble(&message, field, 1) : reflect.SetDouble(&message, field, 1); break;
      case FieldDescriptor::CPPTYPE_FLOAT:
        for (int k = 0; k < (many ? 4 : 1); ++k) many ? reflect.AddFloat(&message, field, 0.5f) : reflect.SetFloat(&message, field, 0.5f);
        break;
      case FieldDescriptor::CPPTYPE_BOOL: many ? reflect.AddBool(&message, field, false) : reflect.SetBool(&message, field, false); break;
      case FieldDescriptor::CPPTYPE_ENUM: many ? reflect.AddEnumValue(&message, field, 1) : reflect.SetEnumValue(&message, field, 1); break;
    }
  }
}

// A server in this process with a room, and somebody in it with a hand.
class Server {
 public:
  Server() : bone_(test::plain_block(6, 3, 0.5)), methods_(methods()) {
    OSTEON_CHECK(bone_.save(dir_ / "case").has_value());
    auto rooms = std::make_unique<Rooms>(RoomsOptions{.cases = {{bone_, dir_ / "case"}}});
    OSTEON_CHECK(rooms->create(kRoom, nullptr).has_value());
    auto started = RoomServer::start(std::move(rooms), "127.0.0.1:0");
    OSTEON_CHECK(started.has_value());
    server_ = std::move(*started);
    stub_ = std::make_unique<grpc::GenericStub>(grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials()));
  }

  [[nodiscard]] std::size_t calls() const { return methods_.size(); }
  [[nodiscard]] Bytes seed(std::size_t call) const {
    const std::unique_ptr<Message> request(
        google::protobuf::MessageFactory::generated_factory()->GetPrototype(methods_[call]->input_type())->New());
    fill(*request);
    const std::string text = request->SerializeAsString();
    Bytes bytes{static_cast<std::uint8_t>(call)};
    bytes.insert(bytes.end(), text.begin(), text.end());
    return bytes;
  }

  // Whatever it is, it is answered: an open stream by its first message or its end, and the server goes on.
  void call(std::span<const std::uint8_t> data) {
    if (data.empty()) return;
    look_after();
    const MethodDescriptor& method = *methods_[data[0] % methods_.size()];
    grpc::Slice slice(data.data() + 1, data.size() - 1);
    const grpc::ByteBuffer request(&slice, 1);
    grpc::ClientContext context;
    context.AddMetadata("osteon-room-bin", kRoom);
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(30));
    grpc::CompletionQueue queue;
    const auto line = stub_->PrepareCall(&context, "/" + method.service()->full_name() + "/" + method.name(), &queue);
    const auto next = [&] {
      void* tag = nullptr;
      bool ok = false;
      OSTEON_CHECK(queue.Next(&tag, &ok));
      return ok;
    };
    line->StartCall(nullptr);
    if (next()) {
      line->WriteLast(request, {}, nullptr);
      (void)next();
    }
    grpc::ByteBuffer answer;
    line->Read(&answer, nullptr);
    const bool answered = next();
    if (answered && method.server_streaming()) context.TryCancel();
    grpc::Status status;
    line->Finish(&status, nullptr);
    (void)next();
    queue.Shutdown();
    void* tag = nullptr;
    bool ok = false;
    while (queue.Next(&tag, &ok)) {
    }
    // Nothing that is sent is an accident of the server's, and none of it is waited for without end.
    OSTEON_CHECK(status.error_code() != grpc::StatusCode::INTERNAL && status.error_code() != grpc::StatusCode::UNKNOWN &&
                 status.error_code() != grpc::StatusCode::DEADLINE_EXCEEDED);
    // Bytes that are no message at all are refused by gRPC itself, which says no more than that.
    OSTEON_CHECK(status.ok() || answered || !status.error_message().empty() ||
                 status.error_code() == grpc::StatusCode::UNIMPLEMENTED);
  }

 private:
  // There is a room to call, and not one more for every input that made one.
  void look_after() {
    Rooms& rooms = server_->rooms();
    if (!rooms.find(kRoom)) OSTEON_CHECK(rooms.create(kRoom, nullptr).has_value());
    const auto open = rooms.open_rooms();
    if (open.size() > kMostRooms)
      for (const auto& room : open)
        if (room->name != kRoom) (void)rooms.remove(room->name, true);
    RoomHost& host = (*rooms.find(kRoom))->host();
    if (!host.knows(AuthorId{1})) OSTEON_CHECK(host.join(MemberKind::surgeon).has_value());
  }

  test::TempDir dir_;
  Case bone_;
  std::vector<const MethodDescriptor*> methods_;
  std::unique_ptr<RoomServer> server_;
  std::unique_ptr<grpc::GenericStub> stub_;
};

Server& server() {
  static Server made;
  return made;
}

}  // namespace

Target calls_target() {
  Target target{"calls", [](std::span<const std::uint8_t> data) { server().call(data); }, {}};
  const std::size_t count = methods().size();
  for (std::size_t call = 0; call < count; ++call) target.seeds.push_back(server().seed(call));
  target.mutations = 10;
  return target;
}

}  // namespace osteon::fuzz
