// A client that speaks HTTP/2 frame by frame over TLS, so that it can say what no gRPC client would (RFC 9113, RFC
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

struct Http2Frame {
  std::uint8_t type = 0;  // 0 DATA, 1 HEADERS, 3 RST_STREAM, 4 SETTINGS, 6 PING, 7 GOAWAY
  std::uint32_t stream = 0;
  std::string payload;
};

class RawHttp2 {
 public:
  // Connects to HOST:PORT and shakes hands, with person.pem and person.key of that folder; without a folder with no
  // certificate. The server's certificate is not looked at.
  explicit RawHttp2(const std::string& address, const std::filesystem::path& person = {});
  ~RawHttp2();
  RawHttp2(const RawHttp2&) = delete;
  RawHttp2& operator=(const RawHttp2&) = delete;

  using Headers = std::vector<std::pair<std::string, std::string>>;
  // HEADERS of a call of gRPC, with `more` after those that each has. False: the connection is closed.
  bool call(std::uint32_t stream, const std::string& path, const Headers& more = {});
  // The one message of a call, here with nothing in it, and the end of what this side says.
  bool send_empty_message(std::uint32_t stream) { return send_message(stream, {}); }
  bool send_message(std::uint32_t stream, const std::string& bytes);
  bool reset(std::uint32_t stream);
  bool send(const std::string& bytes);
  // The next frame; nothing once the connection is closed or nothing came for that long.
  std::optional<Http2Frame> read(std::chrono::milliseconds patience);
  // From now on this machine's system drops whatever arrives, without a word: as where a cable was pulled.
  void go_deaf();
  // True once the server has closed the connection; waits that long for it.
  bool closed_within(std::chrono::milliseconds patience);

 private:
  struct Tls;
  const std::unique_ptr<Tls> tls_;
};

}  // namespace osteon::test
