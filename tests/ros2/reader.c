// Prints the serialised samples of topics as "TOPIC BYTES-IN-HEX", one a line, until its input ends. topics.h, which the test
// writes, lists them.
#include <dds/dds.h>
#include <dds/ddsi/ddsi_serdata.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>

#include "topics.h"

#define MOST 64

int main(int argc, char** argv) {
  const dds_entity_t participant = dds_create_participant((dds_domainid_t)atoi(argv[argc - 1]), NULL, NULL);
  if (participant < 0) return 1;
  dds_entity_t readers[NUM_TOPICS];
  for (int i = 0; i < NUM_TOPICS; ++i) {
    const dds_entity_t topic = dds_create_topic(participant, topics[i].type, topics[i].name, NULL, NULL);
    dds_qos_t* qos = dds_create_qos();  // as ROS 2's subscribers ask
    dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
    dds_qset_history(qos, DDS_HISTORY_KEEP_ALL, 0);
    dds_qset_durability(qos, topics[i].kept ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
    readers[i] = dds_create_reader(participant, topic, qos, NULL);
    dds_delete_qos(qos);
    if (topic < 0 || readers[i] < 0) return 1;
  }
  fprintf(stderr, "ready\n");
  struct pollfd input = {0, POLLIN, 0};
  while (poll(&input, 1, 10) == 0) {
    for (int i = 0; i < NUM_TOPICS; ++i) {
      struct ddsi_serdata* samples[MOST];
      dds_sample_info_t info[MOST];
      const int count = dds_takecdr(readers[i], samples, MOST, info, DDS_ANY_STATE);
      for (int k = 0; k < count; ++k) {
        if (info[k].valid_data) {
          const uint32_t size = ddsi_serdata_size(samples[k]);
          unsigned char* bytes = malloc(size);
          ddsi_serdata_to_ser(samples[k], 0, size, bytes);
          printf("%s ", topics[i].name);
          for (uint32_t b = 0; b < size; ++b) printf("%02x", bytes[b]);
          printf("\n");
          free(bytes);
        }
        ddsi_serdata_unref(samples[k]);
      }
    }
    fflush(stdout);
  }
  dds_delete(participant);
  return 0;
}
