// Who is at the other end of a connection, as far as limits for each client go.
#pragma once

#include <string>

namespace relit::server {

/// The address of a socket's other end, "192.0.2.7"; of IPv6 the network that a client commonly has to
/// itself, "2001:db8:0:7::/64", and the IPv4 address where one is mapped. Empty: it is gone, or none.
[[nodiscard]] std::string peer_address(int socket);

}  // namespace relit::server
