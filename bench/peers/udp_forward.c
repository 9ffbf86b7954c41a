/* The physical floor: recvfrom, sendto, and nothing else. udp_forward TO_PORT PORT_FILE
 * What comes to the port that it writes to PORT_FILE goes to 127.0.0.1:TO_PORT. */
#include <arpa/inet.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

int main(int count, char **words) {
    char datagram[2048];
    struct sockaddr_in here, to;
    socklen_t size = sizeof here;
    int in = socket(AF_INET, SOCK_DGRAM, 0);
    FILE *file;

    if (count != 3) return 2;
    memset(&here, 0, sizeof here);
    here.sin_family = AF_INET;
    here.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to = here;
    to.sin_port = htons((unsigned short)atoi(words[1]));
    if (in < 0 || bind(in, (struct sockaddr *)&here, sizeof here) < 0) return 1;
    if (getsockname(in, (struct sockaddr *)&here, &size) < 0) return 1;
    file = fopen(words[2], "w");
    if (!file) return 1;
    fprintf(file, "%d", ntohs(here.sin_port));
    fclose(file);
    for (;;) {
        ssize_t length = recvfrom(in, datagram, sizeof datagram, 0, NULL, NULL);
        if (length >= 0) sendto(in, datagram, (size_t)length, 0, (struct sockaddr *)&to, sizeof to);
    }
}
