// A client that writes HTTP/2 frames over TLS one by one. So it can send what no gRPC client sends (RFC 9113, RFC
// 7541).
#pragma once
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace osteon::test {

// The path of a call that a person may make.
inline constexpr const char* kGetStatus = "/osteon.v1.RoomService/GetStatus";

struct Http2Frame {
  std::uint8_t type = 0;  // 0 DATA, 1 HEADERS, 3 RST_STREAM, 4 SETTINGS, 6 PING, 7 GOAWAY
  std::uint32_t stream = 0;
  std::string payload;
};

class RawHttp2 {
 public:
  // Connects to HOST:PORT and makes a handshake, with person.pem and person.key of that folder. Without a folder it
  // shows no certificate. It does not check the server's certificate.
  explicit RawHttp2(const std::string& address, const std::filesystem::path& person = {});
  ~RawHttp2();
  RawHttp2(const RawHttp2&) = delete;
  RawHttp2& operator=(const RawHttp2&) = delete;

  using Headers = std::vector<std::pair<std::string, std::string>>;
  // Sends HEADERS of a gRPC call, with `more` after the fields of every call. False: the connection is closed.
  bool call(std::uint32_t stream, const std::string& path, const Headers& more = {});
  // Sends the one message of a call, here an empty one, and the end of this side's stream.
  bool send_empty_message(std::uint32_t stream) { return send_message(stream, {}); }
  bool send_message(std::uint32_t stream, const std::string& bytes);
  bool reset(std::uint32_t stream);
  bool send(const std::string& bytes);
  // The next frame. None if the connection is closed, or if nothing arrives within `patience`.
  std::optional<Http2Frame> read(std::chrono::milliseconds patience);
  // From now on this machine's system drops all that arrives, without an error, as after a pulled cable.
  void go_deaf();
  // Waits at most `patience`. True: the server has closed the connection.
  bool closed_within(std::chrono::milliseconds patience);

 private:
  struct Tls;
  const std::unique_ptr<Tls> tls_;
};

}  // namespace osteon::test
