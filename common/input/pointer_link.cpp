#include "common/input/pointer_link.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

namespace osteon {

namespace {

using nlohmann::json;

constexpr int kVersion = 2;
// Two texts of control characters, of six bytes each in JSON, and all numbers fit into a message.
constexpr std::size_t kMostBytes = 8192, kMostText = 512;
constexpr double kFarthest_mm = 1e5, kMostRpm = 2e5, kMostForce_n = 1e6;

json numbers(const Vec3& v) { return json::array({v.x(), v.y(), v.z()}); }
json numbers(const Eigen::Quaterniond& q) { return json::array({q.w(), q.x(), q.y(), q.z()}); }

// The part of a text that a reader takes. A message with a longer one would be refused as a whole.
std::string shortened(const std::string& text) {
  if (text.size() <= kMostText) return text;
  std::size_t end = kMostText;
  const auto within_character = [&] { return (static_cast<unsigned char>(text[end]) & 0xc0U) == 0x80U; };
  while (end > 0 && within_character()) --end;
  return text.substr(0, end);
}

// Reads the fields of one message. The first one that is wrong is the error.
class Fields {
 public:
  explicit Fields(const json& message) : message_(message) {}

  double number(const char* name, double least, double most) {
    const json* field = find(name);
    if (field == nullptr || !field->is_number()) return wrong(name), least;
    const double value = field->get<double>();
    if (!(value >= least && value <= most)) return wrong(name), least;
    return value;
  }
  bool yes(const char* name) {
    const json* field = find(name);
    if (field == nullptr || !field->is_boolean()) return wrong(name), false;
    return field->get<bool>();
  }
  std::string text(const char* name) {
    const json* field = find(name);
    if (field == nullptr || !field->is_string()) return wrong(name), std::string();
    const auto& value = field->get_ref<const std::string&>();
    if (value.size() > kMostText) return wrong(name), std::string();
    return value;
  }
  template <std::size_t Count>
  std::array<double, Count> array(const char* name, double most) {
    std::array<double, Count> values{};
    const json* field = find(name);
    if (field == nullptr || !field->is_array() || field->size() != Count) return wrong(name), values;
    for (std::size_t i = 0; i < Count; ++i) {
      const json& value = (*field)[i];
      if (!value.is_number()) return wrong(name), values;
      values[i] = value.get<double>();
      if (!(std::abs(values[i]) <= most)) return wrong(name), values;
    }
    return values;
  }
  Vec3 vector(const char* name, double most) { return Vec3(array<3>(name, most).data()); }
  Eigen::Quaterniond rotation(const char* name) {
    const auto [w, x, y, z] = array<4>(name, 1.0 + 1e-6);
    const Eigen::Quaterniond q(w, x, y, z);
    if (!(std::abs(q.norm() - 1.0) < 1e-3)) return wrong(name), Eigen::Quaterniond::Identity();
    return q.normalized();
  }
  [[nodiscard]] const std::string& error() const { return error_; }

 private:
  const json* find(const char* name) const {
    const auto found = message_.find(name);
    return found == message_.end() ? nullptr : &*found;
  }
  void wrong(const char* name) {
    if (error_.empty()) error_ = name;
  }

  const json& message_;
  std::string error_;
};

Result<json> message_of(std::string_view text) {
  if (text.size() > kMostBytes) return failure(ErrorCode::invalid_input, "a pointer's message is too long");
  json message = json::parse(text, nullptr, false);
  if (!message.is_object()) return failure(ErrorCode::invalid_input, "a pointer's message is no JSON object");
  const auto version = message.find("version");
  if (version == message.end() || !version->is_number_integer() || *version != kVersion)
    return failure(ErrorCode::invalid_input,
                   "the pointer speaks another version; install osteon and osteon-haptic of one release");
  return message;
}

Error wrong_field(const std::string& name) {
  return {ErrorCode::invalid_input, "a pointer's message has no usable \"" + name + '"'};
}

Result<sockaddr_un> address_of(const std::filesystem::path& socket) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string& path = socket.native();
  if (path.empty() || path.size() >= sizeof address.sun_path)
    return failure(ErrorCode::invalid_input, "the pointer's socket " + path + ": its path must have from 1 to " +
                                                 std::to_string(sizeof address.sun_path - 1) + " characters");
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
}

Error trouble(const std::filesystem::path& socket, const char* what) {
  return {ErrorCode::internal, "the pointer's socket " + socket.string() + " " + what + ": " + std::strerror(errno)};
}

}  // namespace

// A descriptor that closes itself. The classes of the header have some, so its name is not of this file alone.
class PointerSocket {
 public:
  PointerSocket() = default;
  explicit PointerSocket(int fd) : fd_(fd) {}
  PointerSocket(PointerSocket&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  PointerSocket& operator=(PointerSocket&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~PointerSocket() { close(); }
  void close() {
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
  }
  [[nodiscard]] int get() const { return fd_; }
  explicit operator bool() const { return fd_ >= 0; }

 private:
  int fd_ = -1;
};

namespace {

bool same_user(int fd) {
  ucred peer{};
  socklen_t size = sizeof peer;
  return ::getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &peer, &size) == 0 && peer.uid == ::geteuid();
}

void send_text(PointerSocket& to, const std::string& text) {
  if (!to) return;
  // A full buffer drops the message: a newer one follows. Anything else is the end of the connection.
  if (::send(to.get(), text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL) < 0 && errno != EAGAIN &&
      errno != EWOULDBLOCK && errno != EINTR && errno != ENOBUFS)
    to.close();
}

// Takes all that waits; `take` gets each message.
template <class Take>
void receive_all(PointerSocket& from, Take take) {
  // One byte more, so that the part of a longer message is not taken for a whole one.
  std::array<char, kMostBytes + 1> buffer;
  while (from) {
    const ssize_t size = ::recv(from.get(), buffer.data(), buffer.size(), MSG_DONTWAIT);
    if (size > 0) {
      take(std::string_view(buffer.data(), static_cast<std::size_t>(size)));
    } else if (size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
      return;
    } else if (!(size < 0 && errno == EINTR)) {
      from.close();
    }
  }
}

}  // namespace

std::string encode(const PointerInput& input) {
  return json{{"version", kVersion},
              {"target_mm", numbers(input.target_mm)},
              {"rotation", numbers(input.rotation_bone_tool)},
              {"on_bone", input.on_bone},
              {"push", input.push},
              {"push_n", input.push_n},
              {"fine", input.fine},
              {"spindle", input.spindle},
              {"spindle_rpm", input.spindle_rpm},
              {"tool", shortened(input.tool)}}
      .dump(-1, ' ', false, json::error_handler_t::replace);
}

std::string encode(const PointerOutput& output) {
  return json{{"version", kVersion},
              {"position_mm", numbers(output.pose_bone_tool.position_mm)},
              {"rotation", numbers(output.pose_bone_tool.rotation)},
              {"force_hand_n", numbers(output.force_hand_n)},
              {"force_bone_n", numbers(output.force_bone_n)},
              {"device_holds_n", output.device_holds_n},
              {"push_n", output.push_n},
              {"depth_mm", output.depth_mm},
              {"pushing", output.pushing},
              {"on_metal", output.on_metal},
              {"saturated", output.saturated},
              {"tool", shortened(output.tool)},
              {"trouble", shortened(output.trouble)}}
      .dump(-1, ' ', false, json::error_handler_t::replace);
}

Result<PointerInput> read_pointer_input(std::string_view text) {
  const Result<json> message = message_of(text);
  if (!message) return tl::unexpected(message.error());
  Fields fields(*message);
  PointerInput input;
  input.target_mm = fields.vector("target_mm", kFarthest_mm);
  input.rotation_bone_tool = fields.rotation("rotation");
  input.on_bone = fields.yes("on_bone");
  input.push = fields.yes("push");
  input.push_n = fields.number("push_n", kLeastPush_n, kMostPush_n);
  input.fine = fields.yes("fine");
  input.spindle = fields.number("spindle", 0.0, 1.0);
  input.spindle_rpm = fields.number("spindle_rpm", 0.0, kMostRpm);
  input.tool = fields.text("tool");
  if (!fields.error().empty()) return tl::unexpected(wrong_field(fields.error()));
  return input;
}

Result<PointerOutput> read_pointer_output(std::string_view text) {
  const Result<json> message = message_of(text);
  if (!message) return tl::unexpected(message.error());
  Fields fields(*message);
  PointerOutput output;
  output.pose_bone_tool.position_mm = fields.vector("position_mm", kFarthest_mm);
  output.pose_bone_tool.rotation = fields.rotation("rotation");
  output.force_hand_n = fields.vector("force_hand_n", kMostForce_n);
  output.force_bone_n = fields.vector("force_bone_n", kMostForce_n);
  output.device_holds_n = fields.number("device_holds_n", 0.0, kMostForce_n);
  output.push_n = fields.number("push_n", 0.0, kMostForce_n);
  output.depth_mm = fields.number("depth_mm", -kFarthest_mm, kFarthest_mm);
  output.pushing = fields.yes("pushing");
  output.on_metal = fields.yes("on_metal");
  output.saturated = fields.yes("saturated");
  output.tool = fields.text("tool");
  output.trouble = fields.text("trouble");
  if (!fields.error().empty()) return tl::unexpected(wrong_field(fields.error()));
  return output;
}

struct PointerServer::Impl {
  std::filesystem::path path;
  PointerSocket listening, peer;
  std::optional<PointerOutput> newest;
  std::uint64_t refused = 0;

  // Takes a client that waits, if there is none, and all that it said.
  void attend() {
    while (!peer) {
      PointerSocket waiting(::accept4(listening.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
      if (!waiting) break;
      if (same_user(waiting.get())) peer = std::move(waiting);
    }
    receive_all(peer, [this](std::string_view text) {
      Result<PointerOutput> output = read_pointer_output(text);
      if (output)
        newest = std::move(*output);
      else
        ++refused;
    });
    if (!peer) newest.reset();
  }
};

PointerServer::PointerServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

PointerServer::~PointerServer() { ::unlink(impl_->path.c_str()); }

Result<std::unique_ptr<PointerServer>> PointerServer::listen(const std::filesystem::path& socket) {
  const Result<sockaddr_un> address = address_of(socket);
  if (!address) return tl::unexpected(address.error());
  const auto other = PointerClient::connect(socket);
  if (other || other.error().code == ErrorCode::unavailable || other.error().code == ErrorCode::denied)
    return failure(ErrorCode::exists, "a program listens at the pointer's socket " + socket.string() +
                                          " already; end it, or choose another path");
  auto impl = std::make_unique<Impl>();
  impl->path = socket;
  impl->listening = PointerSocket(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!impl->listening) return tl::unexpected(trouble(socket, "cannot be made"));
  std::error_code ignored;
  if (std::filesystem::is_socket(socket, ignored)) ::unlink(socket.c_str());
  // Nobody else may open it, from the moment it exists.
  const mode_t before = ::umask(0177);
  const int bound = ::bind(impl->listening.get(), reinterpret_cast<const sockaddr*>(&*address), sizeof(sockaddr_un));
  ::umask(before);
  if (bound != 0 || ::listen(impl->listening.get(), 1) != 0) return tl::unexpected(trouble(socket, "cannot be made"));
  return std::unique_ptr<PointerServer>(new PointerServer(std::move(impl)));
}

void PointerServer::send(const PointerInput& input) {
  impl_->attend();
  send_text(impl_->peer, encode(input));
}

const std::optional<PointerOutput>& PointerServer::newest() {
  impl_->attend();
  return impl_->newest;
}

bool PointerServer::connected() {
  impl_->attend();
  return static_cast<bool>(impl_->peer);
}

std::uint64_t PointerServer::refused() const { return impl_->refused; }

struct PointerClient::Impl {
  PointerSocket peer;
  std::uint64_t refused = 0;
};

PointerClient::PointerClient(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

PointerClient::~PointerClient() = default;

Result<std::unique_ptr<PointerClient>> PointerClient::connect(const std::filesystem::path& socket) {
  const Result<sockaddr_un> address = address_of(socket);
  if (!address) return tl::unexpected(address.error());
  auto impl = std::make_unique<Impl>();
  impl->peer = PointerSocket(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!impl->peer) return tl::unexpected(trouble(socket, "cannot be made"));
  if (::connect(impl->peer.get(), reinterpret_cast<const sockaddr*>(&*address), sizeof(sockaddr_un)) != 0) {
    // Others wait for this window already. So it lives, even if it is busy.
    if (errno == EAGAIN)
      return failure(ErrorCode::unavailable, "the window at the pointer's socket " + socket.string() +
                                                 " has a haptic client already; end that one first");
    return failure(ErrorCode::not_found, "no window listens at the pointer's socket " + socket.string() +
                                             "; start osteon, which starts this program by itself");
  }
  if (!same_user(impl->peer.get()))
    return failure(ErrorCode::denied,
                   "the pointer's socket " + socket.string() + " belongs to another user; name one of your own");
  return std::unique_ptr<PointerClient>(new PointerClient(std::move(impl)));
}

std::optional<PointerInput> PointerClient::wait(int milliseconds) {
  if (!impl_->peer) return std::nullopt;
  pollfd ready{impl_->peer.get(), POLLIN, 0};
  if (::poll(&ready, 1, milliseconds) <= 0) return std::nullopt;
  std::optional<PointerInput> newest;
  receive_all(impl_->peer, [&](std::string_view text) {
    Result<PointerInput> input = read_pointer_input(text);
    if (input)
      newest = std::move(*input);
    else
      ++impl_->refused;
  });
  return newest;
}

void PointerClient::send(const PointerOutput& output) { send_text(impl_->peer, encode(output)); }

bool PointerClient::closed() const { return !impl_->peer; }

std::uint64_t PointerClient::refused() const { return impl_->refused; }

}  // namespace osteon
